"""The bank of the empty scene: one model, a marker that nothing collides with, targets anywhere."""

import math

import torch

from world.objects.floor_bank import MARKER, FloorBank

POINT = torch.tensor([[1.0, -2.0], [0.0, 3.0]])
FACING = torch.tensor([[math.cos(0.4), math.sin(0.4)], [-1.0, 0.0]])


def test_every_variant_is_the_one_scene() -> None:
    bank = FloorBank(count=3)
    assert len(bank) == 3 and bank.pieces == (MARKER,) * 3
    assert bank.models[0] is bank.models[2]
    plain = FloorBank().models[0]
    # without furniture no geom but the character's and the floor takes part in contacts
    names = [plain.geom(i).name for i in range(plain.ngeom) if plain.geom_contype[i]]
    assert not [name for name in names if name.startswith(("furniture", "piece"))]


def test_a_target_is_a_point_of_the_floor() -> None:
    origin, yaw = FloorBank.placed(POINT, FACING)
    assert torch.equal(origin[:, :2], POINT) and not origin[:, 2].any()
    assert torch.equal(yaw, FACING)
    target = FloorBank.target(POINT, FACING)
    assert torch.equal(target.point, origin) and torch.equal(target.facing, FACING)
    assert torch.equal(target.corners, origin[:, None].expand(2, 8, 3))
    # rows of it can be written
    target.write(torch.tensor([1]), target.rows(torch.tensor([0])))
    assert torch.equal(target.point[0], target.point[1])
