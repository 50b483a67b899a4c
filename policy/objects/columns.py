"""Columns of a pose row: the pose of a character and its object as numbers."""

from world.character import model as character

_PARTS = (
    ("qpos", character.NQ),
    ("qvel", character.NV),
    ("point", 3),
    ("facing", 2),
    ("corners", 24),
    ("head", 3),
    ("box_position", 3),
    ("box_rotation", 4),
    ("box_velocity", 3),
    ("box_half", 3),
    ("box_start", 3),
    ("box_target", 3),
)


def _slices() -> tuple[dict[str, slice], int]:
    found, start = {}, 0
    for name, width in _PARTS:
        found[name] = slice(start, start + width)
        start += width
    return found, start


COLUMNS, POSE_WIDTH = _slices()
"""Columns of each part of a pose row, and the width of a row."""
