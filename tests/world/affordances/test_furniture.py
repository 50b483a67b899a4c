"""Places to sit and to lie: which pieces offer them, and where trials put them."""

from collections import Counter

import numpy as np
import pytest
import torch
from torch import Tensor

from console.evaluation import trials
from console.evaluation.command import scored as scored_trials
from console.evaluation.scores import Protocol
from world import rotations
from world.affordances import BED, SEAT
from world.affordances.affordance import Setting
from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError, PieceError
from world.furniture.catalogue import SEATS, catalogue, find
from world.initial.reference import unit
from world.motions import load
from world.motions.library import MotionLibrary
from world.motions.uses.seat import SEAT as SEAT_CLIPS
from world.scene import perturbations
from world.scene.batch import Scenes
from world.tasks import Target, make

LIE = WorldConfig(task="lie")
SHORT = Protocol(success_m=0.2, limit_s=0.4, hold_s=0.1)


def still(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """Nothing moves, no time passes."""


def test_lying_places_are_where_the_manifest_has_them() -> None:
    pieces = BED.named("test")
    assert {piece.category for piece in pieces} == {"sofa", "bed", "table"}
    chosen = trials.manifest(pieces, 12, 0)
    results = trials.drive(LIE, still, chosen, 1, 1, record=12)
    task = make("lie")
    for i, track in enumerate(results.tracks):
        # the hip's distance is at least that on the floor; the larger of hip and head counts
        assert results.error_m[i, 0] >= chosen.distance_m[i] - 1e-3
        assert results.error_m[i, 0] <= chosen.distance_m[i] + 1.6
        assert track.state.shape == (1, 114)
    figures = scored_trials(results, chosen, SHORT, task.stages)
    assert [part["stage"] for part in figures["by_stage"]] == [*task.stages, "held"]
    assert figures["success"]["rate"] == 0.0


def test_furniture_that_cannot_be_lain_on_is_refused() -> None:
    chosen = trials.manifest(catalogue("test", 1), 1, 0)
    with pytest.raises(PieceError, match="no place to lie"):
        trials.drive(LIE, still, chosen, 1, 1)


def test_pieces_to_train_on_are_those_of_the_usage() -> None:
    pieces, said = SEAT.pieces(WorldConfig(pieces=8))
    assert {piece.category for piece in pieces} == set(SEATS) and not said
    assert SEAT.bank(WorldConfig(pieces=4, scales=2)).models
    assert all(piece.lie for piece in BED.pieces(WorldConfig(pieces=8))[0])
    with pytest.raises(ConfigError, match="test pieces are held out"):
        SEAT.pieces(WorldConfig(objects=("test",)))
    with pytest.raises(ChoiceError, match="'nowhere': choose one of a folder of pieces, test"):
        SEAT.named("nowhere")


def test_a_single_bed_has_two_places_of_use() -> None:
    assert SEAT.use_point_count(find("chair-train-000")) == 1
    assert {BED.use_point_count(piece) for piece in BED.named("test")} == {1, 2}


def test_states_of_clips_have_furniture_where_the_clip_sits() -> None:
    clips = [clip for clip in load.own_clips() if clip.seat is not None][:3]
    library = MotionLibrary(clips, use=SEAT_CLIPS)
    found = SEAT.clip_states(WorldConfig(), library, catalogue("train", 8), 0, 64)
    assert found is not None and len(found.models) == 64
    distance = (found.qpos[:, :2] - found.origin[:, :2]).norm(dim=1)
    low = found.qpos[:, 2] < 0.6
    # who sits does so on the piece
    assert int(low.sum()) > 3 and float(distance[low].max()) < 0.5
    torch.testing.assert_close(found.yaw.norm(dim=1), torch.ones(64), atol=1e-5, rtol=0)
    assert np.isfinite(found.qpos.numpy()).all()


def test_sit_is_tested_on_eighteen_pieces_with_sofas_and_beds_and_lie_on_twelve() -> None:
    """The paper: 16 and 5."""
    sat = Counter(piece.category for piece in SEAT.named("test"))
    assert sat == dict.fromkeys((*SEATS, "sofa", "bed"), 3)
    assert all(piece.sit for piece in SEAT.named("test"))
    lain = Counter(piece.category for piece in BED.named("test"))
    assert lain == {"sofa": 4, "bed": 4, "table": 4}


def test_training_has_the_classes_that_its_settings_record() -> None:
    new = WorldConfig(pieces=12, classes=SEAT.classes)
    assert Counter(p.category for p in SEAT.pieces(new)[0]) == dict.fromkeys(SEAT.classes, 2)
    older, _ = SEAT.pieces(WorldConfig(pieces=12))
    assert [piece.name for piece in older] == [p.name for p in catalogue("train", 12)]
    assert {p.category for p in SEAT.trial_pieces("train", 1, 0, WorldConfig())} == set(SEATS)
    assert len(SEAT.trial_pieces("train", 1, 0, new)) == 60
    assert Counter(p.category for p in BED.pieces(WorldConfig(task="lie", pieces=6))[0]) == {
        "sofa": 2, "bed": 2, "table": 2,
    }  # fmt: skip
    with pytest.raises(ChoiceError, match="hammock"):
        SEAT.pieces(WorldConfig(classes=("hammock",)))


def test_nobody_begins_a_trial_in_a_bed_or_a_sofa() -> None:
    """From 1 m, in any direction: further away in a line where the footprint is, and only there."""
    pieces = [piece for piece in SEAT.named("test") for _ in range(40)]
    u = torch.rand(len(pieces), 2, generator=torch.Generator().manual_seed(0))
    point, facing = unit(u[:, 0]), unit(u[:, 1])
    nothing = perturbations.draw("none", len(pieces), 0, 1)
    numbers = np.arange(len(pieces))
    made = SEAT.arrange(Setting(pieces, nothing, point, facing, numbers, 0, (1.0, 10.0)))
    assert torch.allclose(made.point / made.point.norm(dim=1, keepdim=True), point, atol=1e-6)
    bank, every = made.bank, torch.arange(len(pieces))
    here = rotations.turn_back(facing, -made.point)
    outside = torch.maximum(bank.low - here, here - bank.high).amax(dim=1)
    assert float(outside.min()) >= 0.35 - 1e-5
    before = rotations.turn_back(facing, -point)
    was = torch.maximum(bank.low - before, before - bank.high).amax(dim=1)
    moved = made.point.norm(dim=1) > 1.0 + 1e-6
    assert torch.equal(moved, was < 0.35 - 1e-6) and 10 < int(moved.sum()) < len(pieces) / 2
    small = torch.tensor([piece.category in SEATS for piece in pieces])
    assert torch.equal(made.point[small], point[small])
    # and what the targets say is where the pieces are
    target = bank.target(every, made.point, facing)
    assert torch.equal(target.point[:, :2], made.point)
