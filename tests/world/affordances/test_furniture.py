"""Places to sit and to lie: which pieces offer them, and where trials put them."""

import numpy as np
import pytest
import torch
from torch import Tensor

from console.evaluation import trials
from console.evaluation.command import scored as scored_trials
from console.evaluation.scores import Protocol
from world.affordances import BED, SEAT
from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError, PieceError
from world.furniture.catalogue import SEATS, catalogue, find
from world.motions import load
from world.motions.library import MotionLibrary
from world.motions.uses.seat import SEAT as SEAT_CLIPS
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
