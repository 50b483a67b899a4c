"""Boxes of trials: their sizes, where they stand, and that they go with their stands."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from torch import Tensor

from console.evaluation import trials
from console.evaluation.command import scored as scored_trials
from console.evaluation.scores import Protocol
from console.recording import format as recording
from world.affordances import CARRIED
from world.affordances.box import boxes
from world.character import model as character
from world.config import CarryConfig, WorldConfig
from world.errors import ConfigError
from world.objects.box_bank import BoxBank
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.box import box
from world.tasks import Target, make

CARRY = WorldConfig(task="carry")
SHORT = Protocol(success_m=0.2, limit_s=0.4, hold_s=0.1)


def still(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """Nothing moves, no time passes."""


def brought(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """An oracle of carry: the box is on its target."""
    assert place.box is not None
    scenes.free_qpos[:, :3] = place.box.target.double()


def test_boxes_are_uniform_in_size_and_weight() -> None:
    plain, weighed = boxes(400, 3, None), boxes(400, 3, (2.0, 8.0))
    widths = np.array([2 * piece.boxes[0].half_m[1] for piece in plain])
    assert 0.25 <= widths.min() < 0.26 and 0.74 < widths.max() <= 0.75  # 50 cm at 0.5-1.5
    assert [piece.boxes for piece in plain] == [piece.boxes for piece in weighed]
    mass = np.array([piece.mass_kg for piece in weighed])
    assert 2.0 <= mass.min() < 2.1 and 7.9 < mass.max() <= 8.0
    assert abs(np.corrcoef(mass, widths)[0, 1]) < 0.15
    assert {piece.name for piece in plain} == {
        "box 0.5-0.75", "box 0.75-1", "box 1-1.25", "box 1.25-1.5",
    }  # fmt: skip


def test_boxes_stand_where_they_should_and_an_oracle_brings_them_all(tmp_path: Path) -> None:
    chosen = trials.manifest(boxes(12, 0, None), 12, 0)
    waiting = trials.drive(CARRY, still, chosen, 1, 1, record=12)
    for i, track in enumerate(waiting.tracks):
        box = track.take.qpos[0, character.NQ :]
        assert np.hypot(*box[:2]) == pytest.approx(chosen.distance_m[i], abs=1e-4)
        half = chosen.pieces[i].boxes[0].half_m[2]
        assert 0.4 <= box[2] - half <= 0.8
        # the target is 1-10 m from the box, on a stand
        way = track.take.stand - box[:3]
        assert 1.0 <= np.hypot(*way[:2]) <= 10.0
        assert waiting.error_m[i, 0] == pytest.approx(
            np.linalg.norm([*way[:2], way[2] + half]), abs=1e-3
        )
    results = trials.drive(CARRY, brought, chosen, SHORT.steps, 1)
    figures = scored_trials(results, chosen, SHORT, make("carry").stages)
    assert figures["success"]["rate"] == 1.0 and figures["sustained"]["rate"] == 1.0
    (row,) = figures["by_class"]
    assert (row["class"], row["trials"], row["success"]) == ("box", 12, 1.0)
    assert row["ci95"] == [pytest.approx(12 / (12 + 1.96**2), abs=1e-3), 1.0]
    path = tmp_path / "carry.msgpack"
    recording.write(path, trials.recording(waiting, {"task": "carry"}))
    read = recording.read(path).takes[0]
    assert np.array_equal(read.stand, waiting.takes[0].stand)
    model = recording.model_of(read)
    assert model.nq == character.NQ + 7
    assert model.body("box").id and 2 * model.geom("box").size[1] == pytest.approx(
        2 * chosen.pieces[0].boxes[0].half_m[1]
    )


def test_boxes_are_the_protocols_whatever_was_trained_on() -> None:
    chosen = trials.manifest(boxes(8, 0, None), 8, 0, 1.0, 5.0)
    narrow = replace(
        CARRY, carry=CarryConfig(scale=(0.5, 0.6), stand_m=(0.7, 0.7), target_m=(9.0, 9.5))
    )
    takes = [trials.drive(world, still, chosen, 1, 1, record=8).takes for world in (CARRY, narrow)]
    for one, other in zip(*takes, strict=True):
        assert np.array_equal(one.qpos, other.qpos) and np.array_equal(one.stand, other.stand)
        assert 1.0 <= np.hypot(*(one.stand - one.qpos[0, 43:46])[:2]) <= 5.0


def test_a_box_moves_with_its_stand() -> None:
    what = perturbations.draw("moved", 16, 0, 600)
    chosen = trials.manifest(boxes(16, 0, None), 16, 0, 1.0, 1.2, disturbance=what)
    results = trials.drive(CARRY, still, chosen, 20, 1, record=16)
    assert 4 <= results.disturbed.sum() < 16  # thresholds of 0.4-2 m, starts at 1-1.2 m
    for moved, take in zip(results.disturbed, results.takes, strict=True):
        shift = take.qpos[-1, 43:45] - take.qpos[0, 43:45]
        stand = take.mocap_pos[-1, :2] - take.mocap_pos[0, :2]
        assert np.hypot(*shift) == pytest.approx(np.hypot(*stand), abs=1e-4)
        assert (np.hypot(*shift) >= 0.5 - 1e-4) == bool(moved)


def test_carry_has_boxes_of_its_own() -> None:
    with pytest.raises(ConfigError, match="leave it out"):
        CARRIED.trial_pieces("train", 4, 0, CARRY)
    with pytest.raises(ConfigError, match="leave it out"):
        CARRIED.pieces(WorldConfig(objects=("train",)))
    assert len(CARRIED.trial_pieces("test", 4, 0, CARRY)) == 4


def test_boxes_of_one_size_and_many_weights() -> None:
    """The paper's fourth row."""
    world = WorldConfig(task="carry")
    found = make("carry").affordance.trial_pieces("weights", 600, 3, world)
    assert {piece.boxes[0].half_m for piece in found} == {box(1.0).boxes[0].half_m}
    masses = np.array([piece.mass_kg for piece in found])
    assert 1.0 <= masses.min() < 1.1 and 11.9 < masses.max() <= 12.0
    assert masses.mean() == pytest.approx(6.5, abs=0.4)
    names = {"box 1-4 kg": (1, 4), "box 4-8 kg": (4, 8), "box 8-12 kg": (8, 12)}
    assert {piece.name for piece in found} == set(names)
    for piece in found:
        low, high = names[piece.name]
        assert low <= piece.mass_kg <= high
    bank = BoxBank(found[:3])
    body = bank.models[0].body("box")
    assert bank.models[0].body_mass[body.id] == pytest.approx(found[0].mass_kg)
