"""States of older checkpoints under today's names."""

import torch

from world.episodes.state_keys import current, part


def test_older_names_are_todays() -> None:
    one, two, three = torch.ones(1), torch.zeros(2), torch.full((3,), 2.0)
    found = current({"porter_phase": one, "patience_clock": two, "qpos": three})
    assert found == {"teacher_phase": one, "stall_clock": two, "qpos": three}
    assert current(found) == found


def test_a_part_loses_its_prefix() -> None:
    one = torch.ones(1)
    assert part({"teacher_phase": one, "clock": one}, "teacher_") == {"phase": one}
