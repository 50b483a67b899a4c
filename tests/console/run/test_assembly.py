"""An experiment put together: which features are the object's, which pieces, and its layout."""

from dataclasses import replace

import pytest

from console.run import assembly
from console.run.experiment import PRESETS, Experiment
from policy.checkpoints import lineage
from policy.checkpoints.format import Manifest
from policy.checkpoints.lineage import Origin
from policy.errors import CheckpointError
from tests.support.paths import ROOT
from world.character.features import STATE
from world.config import WorldConfig
from world.errors import ConfigError
from world.furniture.catalogue import whole


def test_the_layout_is_the_tasks() -> None:
    for task, goal in (("sit", 29), ("lie", 29), ("carry", None)):
        found = assembly.layout(replace(PRESETS["fast"], world=WorldConfig(task=task)))
        assert found.task == task and found.actions == 28 and found.hidden == (512, 256)
        assert sum(width for _, width in found.features) == STATE.width
        if goal is not None and task == "sit":
            assert sum(width for _, width in found.goal) == goal


def test_the_objects_features_are_a_part_of_the_state() -> None:
    mask = assembly.object_mask()
    assert len(mask) == 114 and 0 < mask.sum() < 60


def test_training_never_takes_what_is_held_out() -> None:
    pieces, left = assembly.training_pieces(WorldConfig(pieces=4))
    assert len(pieces) == 4 and not left and all("-train-" in p.name for p in pieces)
    with pytest.raises(ConfigError, match="the test pieces are held out"):
        assembly.training_pieces(WorldConfig(objects=("test",)))
    assert assembly.training_pieces(WorldConfig(task="carry")) == ((), "")
    with pytest.raises(ConfigError, match="carry draws its boxes itself"):
        assembly.training_pieces(WorldConfig(task="carry", objects=("train",)))


def test_a_committed_policy_says_what_made_it() -> None:
    found = assembly.trained(ROOT / "pretrained/sit")
    assert found.task == "sit" and found.experiment.world.task == "sit"
    assert assembly.layout(found.experiment) == found.manifest.layout
    bare = Manifest(found.manifest.layout, 0, 0, {})
    with pytest.raises(CheckpointError, match="records no valid experiment"):
        assembly.experiment_of(bare, found.path)


def test_a_style_service_is_told_everything() -> None:
    experiment = Experiment(seed=4)
    spec = assembly.style_service(experiment, state="here")
    assert spec.seed == 4 and spec.state == "here" and spec.style == experiment.style
    assert spec.object_mask == assembly.object_mask().tolist()
    assert spec.coarse == assembly.coarse().tolist()


def test_imported_pieces_are_named_with_their_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once for each licence and credit; the package's own furniture has the package's licence."""
    ours = whole("test")[0]
    found = [replace(ours, licence=licence, credit="Ann") for licence in ("CC BY", "CC BY", "CC0")]
    monkeypatch.setattr(assembly.collection, "pieces", lambda names: tuple(found))
    fast = PRESETS["fast"]
    experiment = replace(fast, world=replace(fast.world, objects=("train", "/data/mine")))
    clips, *pieces = assembly.origins(experiment)
    assert clips == Origin(assembly.OWN_CLIPS, "Apache-2.0")
    assert pieces == [Origin("furniture of mine", terms, "Ann") for terms in ("CC BY", "CC0")]
    notes = assembly.notes(fast, [Origin("another run", "research only")])
    assert notes["data_licences"] == "Apache-2.0; research only"
    assert lineage.of(notes) == (clips, Origin("another run", "research only"))
