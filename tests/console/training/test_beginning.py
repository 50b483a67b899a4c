"""What a training begins from: unedited settings, and the origins of its weights."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from console.commands import Train
from console.run import assembly, recipe
from console.run.directory import RunDirectory, RunError
from console.run.experiment import Experiment, to_json
from console.run.stages import Stage
from console.training import beginning
from learner.config import LearnerConfig
from policy.checkpoints import lineage
from policy.checkpoints.format import Manifest, read_manifest
from tests.support import small_clips
from tests.support.learning.learners import same
from tests.support.paths import ROOT
from world.config import WorldConfig


def test_a_checkpoint_with_former_names_of_settings_is_unedited() -> None:
    """config.json and checkpoint were written by an earlier version; an edit is still found."""
    recorded = to_json(Experiment())
    overlap = recorded.pop("lag")
    recorded |= {
        "overlap": overlap["overlap"],
        "max_policy_lag": overlap["max_policy"],
        "max_style_lag": overlap["max_style"],
    }
    manifest = cast("Manifest", SimpleNamespace(notes={"experiment": json.dumps(recorded)}))
    run = RunDirectory(Path("run"))
    beginning.require_unedited(manifest, Experiment(), run)
    with pytest.raises(RunError, match=r"scenes: \d+ -> 7 \(restore"):
        beginning.require_unedited(manifest, replace(Experiment(), scenes=7), run)


def test_a_checkpoint_of_a_stage_is_compared_with_that_stage() -> None:
    stages = (Stage("a", settings={"ppo.gamma": 0.9}), Stage("b", settings={"ppo.gamma": 0.8}))
    experiment = replace(Experiment(), stages=stages)
    noted = to_json(recipe.staged(experiment, 2))
    notes = {"experiment": json.dumps(noted), "stage": "2"}
    manifest = cast("Manifest", SimpleNamespace(notes=notes))
    beginning.require_unedited(manifest, experiment, RunDirectory(Path("run")))
    edited = replace(experiment, stages=(stages[0], replace(stages[1], settings={})))
    with pytest.raises(RunError, match=r"ppo\.gamma: 0\.8 -> 0\.985"):
        beginning.require_unedited(manifest, edited, RunDirectory(Path("run")))


def test_the_average_begins_with_the_clone(tmp_path: Path) -> None:
    """Without a warm-up it averaged the clone with the networks as they were drawn."""
    world = WorldConfig(motions=(str(small_clips.write(tmp_path)),), pieces=2, scales=1)
    ppo = LearnerConfig(hidden=(16, 8), warmup_iterations=0)
    experiment = Experiment(world=world, ppo=ppo, clone_passes=1, clone_samples=500)
    learner = assembly.learner(experiment)
    drawn = learner.weights()
    assert len(beginning.clone_clips(learner, experiment)) == 1
    cloned, averaged = learner.weights(), learner.averaged_weights()
    learner.close()
    assert not same(cloned, drawn) and same(averaged, cloned)


NONE = Experiment()


def origins_of(folder: Path) -> list[str]:
    notes = json.loads((folder / "manifest.json").read_text())["notes"]
    return [origin["what"] for origin in json.loads(notes["lineage"])]


def test_origins_of_the_weights_a_training_begins_from(run: Path, tmp_path: Path) -> None:
    """Those of --init, and with --resume those that the checkpoint itself names."""
    command = Train(task="sit", experiment=Experiment())
    own = beginning.inherited(RunDirectory(run), command, NONE)
    assert own == ()
    named = ROOT / "pretrained" / "sit"
    (first,) = beginning.inherited(RunDirectory(run), replace(command, init=named), NONE)
    assert "SAMP" in first.what and "CC BY-NC-SA 4.0" in first.licence
    # and those of a policy that teaches in a stage, once, however many stages it teaches in
    walker = str(ROOT / "pretrained" / "walk")
    settings = {"world.walker": walker, "ppo.imitation_weight": 0.1}
    taught = replace(NONE, stages=(Stage("a"), Stage("b", "", settings), Stage("c", "", settings)))
    found = beginning.inherited(RunDirectory(run), command, taught)
    assert found == lineage.of(read_manifest(Path(walker)).notes) and "CMU" in str(found)
    resumed = beginning.inherited(RunDirectory(run), replace(command, resume=True), NONE)
    assert [origin.what for origin in resumed] == origins_of(run / "checkpoints" / "latest")
    assert resumed[0].what == assembly.OWN_CLIPS and resumed[0].licence == "Apache-2.0"
    # a damaged newest checkpoint is passed over
    copy = RunDirectory(tmp_path / "copy")
    copy.create()
    for name in ("000001", "000002"):
        (copy.checkpoints / name).mkdir()
    manifest = (run / "checkpoints" / "latest" / "manifest.json").read_text()
    (copy.checkpoints / "000001" / "manifest.json").write_text(manifest)
    (copy.checkpoints / "000002" / "manifest.json").write_text("{")
    assert beginning.inherited(copy, replace(command, resume=True), NONE) == resumed
