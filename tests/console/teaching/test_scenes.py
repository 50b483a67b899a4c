"""The scenes of DAgger: initial states, and the state in which a box was lifted."""

import torch

from console.commands.teaching import Practice
from console.teaching.scenes import TeachingScenes
from world.character import model as character
from world.config import WorldConfig
from world.scene.box import BOX_SIZE_M
from world.teachers.scripted.controller import Phase


def test_episodes_start_where_a_box_was_lifted() -> None:
    """The same states again, with the box in hand, and the teacher in its phase of then."""
    torch.set_num_threads(1)
    n = 12
    practice = Practice(scenes=n, steps=10, in_hand=0.0, near=1.0, lifted=1.0, seed=3)
    scenes = TeachingScenes(practice, WorldConfig(task="carry"))
    once = torch.zeros(n, dtype=torch.bool)
    for _ in range(40):
        scenes.collect(None, 1.0)
        once |= scenes.controller.phase == Phase.CARRY
        if once.sum() >= 8:
            break
    assert once.sum() >= 8
    scenes.restart(torch.ones(n, dtype=torch.bool))
    again = scenes.controller.phase == Phase.CARRY
    assert torch.equal(again, again & once), "only where a box was lifted"
    assert again.sum() >= 6
    rows = again.nonzero().flatten()
    box = scenes.scenes.now(scenes.target).box
    assert box is not None
    moved = (box.position - box.start)[rows]
    assert ((moved[:, 2] > 0.03) | (moved[:, :2].norm(dim=1) > 0.2)).all()
    bodies = scenes.scenes.body().position[rows]
    hands = bodies[:, [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]]
    assert ((hands - box.position[rows, None]).norm(dim=2) < 0.6).all()
    fell = torch.zeros(n, dtype=torch.bool)
    for _ in range(30):
        fell |= scenes.drive()[0]
    assert fell[rows].float().mean() <= 0.35, "the teacher continues with the box"


def test_more_boxes_may_be_large() -> None:
    """At an exponent of 0.5, three of four are in the upper half of the sizes."""
    scenes = TeachingScenes(Practice(scenes=4, skew=0.5), WorldConfig(task="carry"))
    scale = scenes.bank.half[:, 0].float() / (0.5 * BOX_SIZE_M[0])
    wanted = 0.5 + torch.tensor([0.125, 0.375, 0.625, 0.875]).sqrt()
    torch.testing.assert_close(scale, wanted, atol=1e-4, rtol=0)
    assert (scale > 1.0).tolist() == [False, True, True, True]
