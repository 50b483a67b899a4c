"""The geometry of a grip: inverse kinematics of the arm against forward kinematics."""

import numpy as np
import pytest
import torch

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.character.features import body
from world.objects import grasp
from world.objects.box_bank import BoxBank, resting
from world.scene.box import box
from world.tasks.carry import reach_m

RIGHT_UPPER, RIGHT_LOWER = grasp._SIDES[0][:2]
RIGHT_HAND = character.BODIES.index("right_hand")


def test_matrices_and_quaternions_are_inverse() -> None:
    q = rotations.normalise(
        torch.randn(500, 4, generator=torch.Generator().manual_seed(0)).double()
    )
    # half turns, where the real part is 0
    q = torch.cat((q, torch.eye(4, dtype=torch.float64)))
    back = rotations.from_matrix(rotations.matrix(q))
    torch.testing.assert_close((back * q).sum(dim=1).abs(), torch.ones(len(q), dtype=torch.float64))


def pose(shoulder: np.ndarray, elbow: float) -> torch.Tensor:
    """Standing, the right arm at this rotation vector and angle: qpos [1, 43]."""
    qpos = character.standing_qpos()
    angle = np.linalg.norm(shoulder)
    address = character.BALL_QPOS[2]
    qpos[address] = np.cos(angle / 2)
    qpos[address + 1 : address + 4] = np.sin(angle / 2) * shoulder / angle
    qpos[character.HINGE_QPOS[0]] = elbow
    return torch.from_numpy(qpos).float()[None]


def forward(qpos: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    local = rotations.matrix(kinematics.local_rotations(qpos))
    return kinematics.forward(qpos[:, :3], local)


@pytest.mark.parametrize("pitch", [-1.4, -0.9, -0.4])
def test_the_arm_reaches_its_goal(pitch: float) -> None:
    position, rotation = forward(pose(np.array([-0.3, pitch, 0.2]), 1.0))
    goal = position[:, RIGHT_HAND] + torch.tensor([[-0.05, 0.03, 0.06]])
    angles = grasp._arm_angles(position, rotation, goal, -1.0, RIGHT_UPPER, RIGHT_LOWER)[0]
    reached, _ = forward(pose(angles[:3].numpy(), float(angles[3])))
    torch.testing.assert_close(reached[:, RIGHT_HAND], goal, atol=1e-5, rtol=0)


def test_a_goal_out_of_reach_is_approached_with_a_stretched_arm() -> None:
    position, rotation = forward(pose(np.array([-0.3, -0.9, 0.2]), 1.0))
    shoulder = position[:, RIGHT_UPPER]
    goal = shoulder + torch.tensor([[0.9, 0.0, 0.0]])
    angles = grasp._arm_angles(position, rotation, goal, -1.0, RIGHT_UPPER, RIGHT_LOWER)[0]
    assert float(angles[3]) < 0.25, "nearly straight"
    reached, _ = forward(pose(angles[:3].numpy(), float(angles[3])))
    way = reached[:, RIGHT_HAND] - shoulder
    assert float(way[0, 0] / way.norm()) > 0.99, "towards the goal"


def test_hands_hold_a_box_on_both_sides() -> None:
    """Boxes of 25 to 75 cm width before the standing body: both hands are within 2 cm. About the
    middle of the larger ones the arms would not reach."""
    bank = BoxBank([box(scale) for scale in (0.5, 0.7, 0.9, 1.1, 1.3, 1.5)])
    n = len(bank)
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
    ahead = torch.tensor([[1.0, 0.0]]).repeat(n, 1)
    at = grasp.held_centre(qpos[:, :3], ahead, bank.half[:, 0])
    at[:, 2] += (bank.half[:, 2] - 0.15).clamp_min(0.0)
    place = bank.target(torch.arange(n), resting(at, ahead, at + 3.0))
    assert place.box is not None
    held = grasp.holding_pose(qpos, place.box)
    assert reach_m(body(held, torch.zeros(n, character.NV)), place.box).max() < 0.02
    arms = torch.ones(character.NQ, dtype=torch.bool)
    for _, _, ball, hinge in grasp._SIDES:
        arms[ball : ball + 4] = False
        arms[hinge] = False
    assert torch.equal(held[:, arms], qpos[:, arms]), "the arms alone are moved"
    # the stretch is that of the solved arms: distance from shoulder to hand by forward kinematics
    position, _ = forward(held)
    shoulders, hands = grasp._SIDES[0][0], RIGHT_HAND
    apart = (position[:, hands] - position[:, shoulders]).norm(dim=1)
    length = grasp._UPPER_M + grasp._FORE_M
    torch.testing.assert_close(
        grasp.stretch(qpos, place.box)[:, 0], apart / length, atol=2e-3, rtol=0
    )


def test_a_deep_box_is_held_near_the_body() -> None:
    """By hand: size 1.5 is 0.525 m deep, its hold 0.0875 m before the centre of its face; the box
    is turned by 90 degrees, so that its long side, 0.75 m, is along the heading."""
    bank = BoxBank([box(1.0), box(1.5), box(1.5)])
    ahead = torch.tensor([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    at = torch.tensor([[0.5, 0.0, 1.0]]).repeat(3, 1)
    place = bank.target(torch.arange(3), resting(at, ahead, at + 3.0)).box
    assert place is not None
    grip = grasp.grip_of(place, torch.tensor([[1.0, 0.0]]).repeat(3, 1))
    expected = torch.tensor([[0.0, 0.0, 0.0], [-0.0875, 0.0, 0.0], [-0.2, 0.0, 0.0]])
    torch.testing.assert_close(grip.nearer, expected, atol=1e-6, rtol=0)
