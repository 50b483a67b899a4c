"""Rest that the reference does not show: a hand in the air, a bent neck."""

import math

import pytest
import torch

from world.character import features
from world.character import model as character
from world.realism import rest
from world.realism.measures import Motion

BALLS = [joint.name for joint in character.JOINTS if joint.is_ball]


def standing(frames: int = 40) -> torch.Tensor:
    return torch.from_numpy(character.standing_qpos()).repeat(frames, 1)


def turned(qpos: torch.Tensor, joint: str, angle_rad: float, axis: int = 1) -> torch.Tensor:
    """qpos with a ball joint turned from 0 about one of its axes."""
    found, start = qpos.clone(), character.BALL_QPOS[BALLS.index(joint)]
    found[:, start : start + 4] = 0.0
    found[:, start] = math.cos(0.5 * angle_rad)
    found[:, start + 1 + axis] = math.sin(0.5 * angle_rad)
    return found


def still(*qpos: torch.Tensor) -> list[Motion]:
    return [Motion(each, torch.zeros(len(each), character.NV)) for each in qpos]


def hand_m(qpos: torch.Tensor) -> float:
    """Height of the right hand above the pelvis in the first frame, m."""
    position = features.body(qpos.float(), torch.zeros(len(qpos), character.NV)).position
    hand = character.BODIES.index("right_hand")
    return float(position[0, hand, 2] - position[0, 0, 2])


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_hand_that_is_held_up(side: str) -> None:
    """10 of 40 frames with a raised arm, whichever it is; none where people raise the right one."""
    hangs = standing()
    raised = turned(hangs, f"{side}_shoulder", -1.5)
    right = turned(hangs, "right_shoulder", -1.5)
    assert hand_m(right) > hand_m(hangs) + 0.2
    ours = still(torch.cat((hangs[:30], raised[:10])))
    assert rest.outside(ours, still(hangs)) == pytest.approx(0.25)
    assert rest.outside(ours, still(hangs, right)) == 0.0


def test_a_bent_neck_and_what_is_within_the_slack() -> None:
    """0.3 rad is beyond the slack of 0.1, 0.05 rad is within."""
    rests = standing()
    assert rest.outside(still(turned(rests, "neck", 0.3)), still(rests)) == 1.0
    assert rest.outside(still(turned(rests, "neck", 0.05)), still(rests)) == 0.0


def test_what_moves_does_not_rest_and_a_second_is_needed() -> None:
    rests = standing()
    raised = turned(rests, "right_shoulder", -1.5)
    moves = torch.zeros(40, character.NV)
    moves[:, 0] = 0.2
    assert rest.outside([Motion(raised, moves)], still(rests)) is None
    assert rest.outside([Motion(raised, moves), *still(rests)], still(rests)) == 0.0
    assert rest.outside(still(raised[:29]), still(rests)) is None
    assert rest.outside(still(raised), still(rests[:29])) is None
    assert rest.outside([], still(rests)) is None
