"""States in which boxes were lifted are kept by scene, with what the teacher knew then."""

import torch

from console.teaching.lifted import LiftedStates, overwrite
from world.objects.box_bank import Layout, resting


def layout(x: float, n: int) -> Layout:
    at = torch.full((n, 3), x)
    return resting(at, torch.tensor([[1.0, 0.0]]).repeat(n, 1), at + 1.0)


def test_the_newest_state_of_each_scene_is_kept() -> None:
    teacher = {"phase": torch.arange(3)}
    kept = LiftedStates(torch.zeros(3, 43), torch.zeros(3, 34), layout(0.0, 3), teacher)
    assert not kept.exists.any()
    rows = torch.tensor([2])
    kept.keep(
        rows, torch.ones(1, 43), torch.ones(1, 34), layout(5.0, 1), {"phase": torch.arange(3) + 7}
    )
    assert kept.exists.tolist() == [False, False, True]
    assert kept.qpos[:, 0].tolist() == [0.0, 0.0, 1.0]
    assert kept.layout.position[:, 0].tolist() == [0.0, 0.0, 5.0]
    assert kept.teacher["phase"].tolist() == [0, 1, 9]
    # what was given is not written to
    assert teacher["phase"].tolist() == [0, 1, 2]


def test_rows_of_a_layout_are_overwritten() -> None:
    whole = layout(0.0, 3)
    overwrite(whole, torch.tensor([0, 1]), layout(2.0, 2))
    assert whole.target[:, 2].tolist() == [3.0, 3.0, 1.0]
