"""Frames that a file's numbering leaves out."""

from collections.abc import Mapping, Sequence

import numpy as np

LONGEST_GAP = 12
"""Greatest number of absent frames in a row that are filled in: 0.1 s at 120 frames a second."""


def filled(
    numbers: Sequence[int],
    values: dict[str, np.ndarray],
    periods: Mapping[str, Sequence[float | None]],
    remarks: list[str],
) -> dict[str, np.ndarray]:
    """The values [T, D] of each name with those of absent frames, which a jump in the numbers
    tells, linearly between their neighbours'.

    Args:
        numbers: [T], the frames' own numbers.
        values: [T, D] by name.
        periods: [D] by name, the period of an angle, on which the shorter way is taken; None for
            other values.
        remarks: gets what was done, in words.

    Raises ValueError for a gap of more than LONGEST_GAP frames.
    """
    at = np.array(numbers)
    steps = np.diff(at)
    if not len(steps) or steps.min() < 1:
        return values  # the numbers begin anew: they do not count frames
    step = int(steps.min())
    if step > 1:
        remarks.append(f"the frames' numbers go in steps of {step}: each is read as a frame")
    if (steps == step).all():
        return values
    worst = int(steps.argmax())
    if steps[worst] > (LONGEST_GAP + 1) * step:
        raise ValueError(
            f"no frame between {at[worst]} and {at[worst + 1]}; gaps of at most {LONGEST_GAP}"
            " frames are filled in: cut the file there"
        )
    every = np.arange(at[0], at[-1] + 1, step)
    remarks.append(f"{len(every) - len(at)} absent frames are filled in between their neighbours")

    def between(column: np.ndarray, period: float | None) -> np.ndarray:
        whole = column if period is None else np.unwrap(column, period=period)
        return np.interp(every, at, whole)

    return {
        name: np.stack(
            [between(c, period) for c, period in zip(rows.T, periods[name], strict=True)], axis=1
        )
        for name, rows in values.items()
    }
