"""Turns of a measurement that lasts for a time, with the time left by the turns that are done."""

import time
from collections.abc import Callable, Iterator

from console.terminal import progress


def turns(
    seconds: float,
    least: int,
    most: int | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Iterator[int]:
    """Yield 0, 1, 2, ... until both `seconds` are over and `least` turns are done, or `most` are.

    The progress is what is further from its end: the time or the number of turns.
    """
    with progress("per cent measured", 100.0) as note:
        began, done = clock(), 0
        while (most is None or done < most) and (done < least or clock() - began < seconds):
            yield done
            done += 1
            of_time = (clock() - began) / seconds if seconds > 0 else 1.0
            of_turns = done / least if least else 1.0
            of_most = done / most if most else 0.0
            note(100.0 * min(1.0, max(min(of_time, of_turns), of_most)))
