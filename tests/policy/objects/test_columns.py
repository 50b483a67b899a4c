"""The columns of a row of numbers lie side by side and fill it."""

from policy.objects.columns import COLUMNS, POSE_WIDTH


def test_columns_lie_side_by_side() -> None:
    assert COLUMNS["qpos"] == slice(0, 43) and COLUMNS["qvel"] == slice(43, 77)
    ends = [part.stop for part in COLUMNS.values()]
    assert [part.start for part in COLUMNS.values()] == [0, *ends[:-1]] and ends[-1] == POSE_WIDTH
