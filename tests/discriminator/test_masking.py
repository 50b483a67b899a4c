"""What is hidden while a box is in hand."""

import torch

from console.run.assembly import holding
from discriminator.masking import hide
from discriminator.protocols import Holding
from world.character.features import STATE


def test_arms_are_hidden_while_both_hands_are_at_the_box() -> None:
    held = holding()
    states = torch.zeros(3, STATE.width)
    states[:, STATE.slice("object_position")] = torch.tensor([0.4, 0.0, 0.1])
    for row, apart in enumerate((0.3, 0.3, 0.5)):
        states[row, STATE.slice("position_right_hand")] = torch.tensor([0.4, -apart, 0.1])
        states[row, STATE.slice("position_left_hand")] = torch.tensor([0.4, 0.3, 0.1])
    states[1, STATE.slice("position_left_hand")] = torch.tensor([0.4, 0.6, 0.1])  # one hand alone
    normalised = torch.ones_like(states)
    found = hide(normalised, states, held)
    assert torch.equal(found[0] == 0.0, held.hidden)
    assert torch.equal(found[1:], normalised[1:])


def test_the_arms_are_shoulders_elbows_and_hands() -> None:
    hidden = holding().hidden
    whole = {f.name for f in STATE if bool(hidden[STATE.slice(f.name)].all())}
    assert whole == {
        f"{part}_{side}_{joint}"
        for side in ("right", "left")
        for part, joint in (("rotation", "shoulder"), ("angle", "elbow"), ("position", "hand"))
    }
    velocities = hidden[STATE.slice("joint_velocity")]
    assert int(velocities.sum()) == 2 * (3 + 1)
    assert int(hidden.sum()) == 2 * (6 + 1 + 3) + 8


def test_it_travels_as_json() -> None:
    one = holding()
    other = Holding.from_json(one.to_json())
    assert other.within_m == one.within_m
    for name in ("hands", "box", "hidden"):
        assert torch.equal(getattr(one, name), getattr(other, name))
