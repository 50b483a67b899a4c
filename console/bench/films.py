"""`inhabit bench films`: the writing of a film, drawn in one process and in several."""

import itertools
import resource
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

from console.bench.turns import turns
from console.commands import Video
from console.recording.format import Recording
from console.run import machine
from console.video import camera, command, rendering
from console.video.drawing import FILM, Artist

#: Images per second that a film of 640 x 480 pixels reaches on two quiet cores.
GOAL_IMAGES_PER_S = 60.0
#: Trials in a film; images that are drawn before the clock of the drawing starts.
_TRIALS, _WARM_UP = 4, 5


def measure(source: Path, seconds: float, threads: int) -> dict[str, float]:
    """Write a film of a policy's trials in turn with one drawing process and with one for each of
    `threads` cores, for `seconds` in all and twice at least; return rates and processor times.

    source: a policy's name, a run or a checkpoint.
    """
    rendering.require_gl()
    found = command.played(Video(source, trials=_TRIALS, threads=threads))
    return of_recording(found, seconds, threads)


def of_recording(found: Recording, seconds: float, threads: int) -> dict[str, float]:
    """Return the figures of films of a recording; see `measure`."""
    images, memory = rendering.image_count(found), 0.0
    processes = rendering.processes_for(images, threads)
    wall, spent, differing = [0.0, 0.0], [0.0, 0.0], 0

    def progress(done: int) -> None:
        nonlocal memory
        if done == images // 2:
            memory = max(memory, machine.process_tree_gb())

    rounds = 0
    with tempfile.TemporaryDirectory() as folder:
        films = [Path(folder) / name for name in ("one.mp4", "several.mp4")]
        for turn in turns(seconds, 2):
            for way, film in enumerate(films):
                processor, clock = _processor_s(), time.perf_counter()
                rendering.write_video(found, film, progress=progress, threads=threads if way else 1)
                wall[way] += time.perf_counter() - clock
                spent[way] += _processor_s() - processor
            differing += films[0].read_bytes() != films[1].read_bytes()
            rounds = turn + 1
    count = rounds * images
    one, several = (1e3 * s / count for s in spent)
    return {
        "images_per_s": count / wall[1],
        "one_process_images_per_s": count / wall[0],
        "to_one_process_ratio": wall[0] / wall[1],
        "processes_count": float(processes),
        "processor_ms_per_image": several,
        "one_process_processor_ms_per_image": one,
        "draw_processor_ms_per_image": _drawing_ms(found),
        "quiet_images_per_s": 1e3 * processes / several,
        "goal_images_per_s": GOAL_IMAGES_PER_S,
        "differing_films": float(differing),
        "film_resident_gb": memory,
        "images": float(images),
    }


def _drawing_ms(found: Recording) -> float:
    """Return the processor time to draw an image of the first take, in this process alone, ms."""
    frames: Iterator[int] = iter(camera.frames_of(found.takes[0]))
    with closing(Artist(found.takes, FILM)) as artist:
        for frame in itertools.islice(frames, _WARM_UP):
            artist.image(0, frame)
        began, count = time.process_time(), 0
        for frame in frames:
            artist.image(0, frame)
            count += 1
        return 1e3 * (time.process_time() - began) / max(1, count)


def _processor_s() -> float:
    """Return the processor time of this process and its children that have ended, s."""
    whole = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in whole)
