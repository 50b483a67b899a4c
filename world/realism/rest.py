"""How often a character rests as nobody in the reference does: a hand in the air, the head bent."""

from collections.abc import Sequence

import torch
from torch import Tensor

from world import rotations
from world.character import features, kinematics
from world.character import model as character
from world.realism.measures import Motion

#: A root that is slower than this rests, m/s.
RESTS_M_S = 0.15
#: Frames at rest that a range needs: one second.
LEAST = 30
#: The range is from this quantile of the reference to the opposite one, and so much wider: for
#: heights, m, and for the neck, rad.
_QUANTILE, _SLACK_M, _SLACK_RAD = 0.01, 0.02, 0.1
#: Bodies of equal kind, whose range is one: head, hands, feet.
_KINDS = (("head",), ("right_hand", "left_hand"), ("right_foot", "left_foot"))
_HEAD = character.BODIES.index("head")


def outside(motions: Sequence[Motion], reference: Sequence[Motion]) -> float | None:
    """Return the fraction of the frames at rest in which the head, a hand or a foot is higher above
    the pelvis or lower than in the reference at rest, or the neck bent more or less.

    None where either has less than a second at rest.
    """
    ours, theirs = _resting(motions), _resting(reference)
    if min(len(ours), len(theirs)) < LEAST:
        return None
    slack = [_SLACK_M] * len(_KINDS) + [_SLACK_RAD]
    found = torch.zeros(len(ours), dtype=torch.bool)
    for rows, known, more in zip(_poses(ours), _poses(theirs), slack, strict=True):
        low, high = (known.flatten().quantile(q) for q in (_QUANTILE, 1.0 - _QUANTILE))
        found |= ((rows < low - more) | (rows > high + more)).any(dim=1)
    return float(found.double().mean())


def _resting(motions: Sequence[Motion]) -> Tensor:
    """qpos [F, 43] of the frames at rest."""
    rests = [motion.qpos[motion.qvel[:, :3].norm(dim=1) < RESTS_M_S] for motion in motions]
    return torch.cat([torch.zeros(0, character.NQ), *rests]).float()


def _poses(qpos: Tensor) -> list[Tensor]:
    """Heights [F, 1 or 2] of each kind of body above the pelvis, m, and the angle [F, 1] of the
    neck, rad, of F frames."""
    height = features.body(qpos, torch.zeros(len(qpos), character.NV)).position[..., 2]
    kinds = [[character.BODIES.index(name) for name in kind] for kind in _KINDS]
    neck = rotations.to_rotation_vector(kinematics.local_rotations(qpos)[:, _HEAD])
    above = [height[:, bodies] - height[:, :1] for bodies in kinds]
    return [*above, neck.norm(dim=1, keepdim=True)]
