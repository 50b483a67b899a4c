"""The offsets of the set-points press the hands together and up, by the arms alone."""

import torch

from world import rotations
from world.character import kinematics
from world.character import model as character
from world.initial.squeeze import squeeze

STAND = torch.from_numpy(character.standing_qpos())[None]


def arms() -> list[int]:
    """The controls of both arms."""
    found, control = [], 0
    for joint in character.JOINTS:
        width = 3 if joint.is_ball else 1
        if joint.name.endswith(("shoulder", "elbow")):
            found += range(control, control + width)
        control += width
    return found


def test_only_the_arms_get_new_set_points() -> None:
    offset = squeeze(STAND, torch.tensor([20.0]), torch.tensor([10.0]))[0]
    others = [i for i in range(character.NU) if i not in arms()]
    assert offset[arms()].abs().max() > 0.01 and not offset[others].any()
    assert not squeeze(STAND, torch.zeros(1), torch.zeros(1)).any()


def test_offsets_grow_with_the_force_and_are_bounded() -> None:
    one, two = (squeeze(STAND, torch.tensor([force]), torch.zeros(1))[0] for force in (5.0, 10.0))
    torch.testing.assert_close(two, 2.0 * one)
    huge = squeeze(STAND, torch.tensor([1e6]), torch.zeros(1))[0]
    assert huge.abs().max() == 0.5


def test_both_hands_press_towards_each_other_and_up() -> None:
    """A small turn of the elbows along the offsets moves the hands along the forces."""
    hands = [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]

    def positions(qpos: torch.Tensor) -> torch.Tensor:
        local = rotations.matrix(kinematics.local_rotations(qpos))
        return kinematics.forward(qpos[:, :3], local)[0][0, hands]

    offset = squeeze(STAND, torch.zeros(1), torch.tensor([10.0]))[0]
    control = 0
    qpos, address = STAND.clone(), 7
    for joint in character.JOINTS:
        if joint.is_ball:
            turn = rotations.from_rotation_vector(offset[control : control + 3][None])
            ball = qpos[:, address : address + 4]
            qpos[:, address : address + 4] = rotations.multiply(ball, turn)
            address, control = address + 4, control + 3
        else:
            qpos[:, address] += offset[control]
            address, control = address + 1, control + 1
    assert (positions(qpos) - positions(STAND))[:, 2].min() > 0.0
