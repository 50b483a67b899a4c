"""What the service says of itself, against the character's own table."""

import mujoco
import pytest
import torch

from policy.messages import description
from tests.support.policy_cases import NOTES, make
from world.character import model as character
from world.character.features import STATE


def test_servos_are_those_of_the_model() -> None:
    servos = description.servos()
    model = character.spec().compile()
    assert len(servos) == model.nu == character.NU
    assert [servo.name for servo in servos[:3]] == [
        f"{character.JOINTS[0].name}_{a}" for a in "xyz"
    ]
    for index, servo in enumerate(servos):
        assert servo.kp == pytest.approx(model.actuator_gainprm[index, 0])
        assert servo.kd == pytest.approx(-model.actuator_biasprm[index, 2])


def test_bodies_and_joints_are_a_tree_in_order() -> None:
    bodies = description.bodies()
    assert [body.name for body in bodies] == list(character.BODIES)
    assert bodies[0].parent == -1 and all(b.parent < i for i, b in enumerate(bodies) if i)
    kinds = [joint.kind for joint in description.joints()]
    assert kinds.count("ball") == 8 and kinds.count("hinge") == 4
    assert all(bool(joint.axis) == (joint.kind == "hinge") for joint in description.joints())


def test_the_model_compiles_again() -> None:
    model = mujoco.MjModel.from_xml_string(description.mjcf())
    assert (model.nq, model.nv, model.nu) == (character.NQ, character.NV, character.NU)


def test_a_policy_tells_its_numbers() -> None:
    served = make(3)
    told = description.policy(served, reloads=2, last_refusal="torn")
    assert (told.task, told.iteration, told.samples) == ("sit", 3, 3000)
    assert (told.reloads, told.last_refusal, told.checkpoint) == (2, "torn", served.digest)
    assert sum(feature.width for feature in told.state) == STATE.width == 114
    assert sum(feature.width for feature in told.goal) == served.task.goal.width
    low, high = (torch.tensor(list(b)) for b in (told.action.low_rad, told.action.high_rad))
    assert (low < high).all() and len(low) == told.action.width == 28
    assert {term.name: term.weight for term in told.reward_terms} == served.task.terms


def test_data_and_licence_are_listed_or_listed_as_missing() -> None:
    assert description.training_data(NOTES) == ("none", "Apache-2.0")
    assert description.training_data({"data_licences": "CC BY"})[1] == "CC BY"
    data, licence = description.training_data({})
    assert "not published" in data and licence == "not stated"
