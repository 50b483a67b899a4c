"""States of older checkpoints under today's names."""

import torch

from world.episodes.state_keys import current, part


def test_older_names_are_todays() -> None:
    one, two = torch.zeros(2), torch.full((3,), 2.0)
    found = current({"patience_clock": one, "qpos": two})
    assert found == {"stall_clock": one, "qpos": two}
    assert current(found) == found


def test_a_part_loses_its_prefix() -> None:
    one = torch.ones(1)
    assert part({"teacher_phase": one, "clock": one}, "teacher_") == {"phase": one}
