"""Loading of policies from runs or checkpoint folders, for services, export and the player."""

import json
from pathlib import Path
from typing import Any, Literal

from console.evaluation.style_judge import judge_of
from console.run import assembly
from console.run.directory import checkpoint_folder
from learner.config import piecewise
from policy.checkpoints.format import read_manifest
from policy.checkpoints.reload import Source
from policy.checkpoints.run_checkpoints import stage_samples
from policy.checkpoints.served import Served
from policy.errors import CheckpointError

Which = Literal["best", "latest"]


def checkpoint_of(source: Path, which: Which) -> Path:
    """Return the checkpoint of a run by name, best or latest, else its newest one.

    Raises RunError without a checkpoint.
    """
    named = source / "checkpoints" / which
    if (named / "manifest.json").exists():
        return named.resolve()
    return checkpoint_folder(source)


def task_of(path: Path) -> str:
    """Return the task of a checkpoint folder's policy."""
    return read_manifest(path).layout.task


def served(name: str, path: Path) -> Served:
    """Return the policy of a checkpoint folder; InhabitError for an unusable one."""
    found = assembly.trained(path)
    experiment, judge = found.experiment, judge_of(found)
    return Served(
        name=name,
        weights=found.weights,
        manifest=found.manifest,
        world=experiment.world,
        digest=_digest(path),
        sigma=piecewise(experiment.ppo.sigma, stage_samples(found.manifest)),
        # a stream's frame has one state before it
        style=None if judge is None or judge.window != 2 else judge.reward,
    )


def source(name: str, where: Path, which: Which) -> Source:
    """Return the source of a policy, which follows the checkpoints of its run."""
    return Source(name, lambda: checkpoint_of(where, which), lambda path: served(name, path))


def _digest(path: Path) -> str:
    file = path / "manifest.json"
    try:
        raw: dict[str, Any] = json.loads(file.read_text())
        return str(raw["files"]["policy.safetensors"]["sha256"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CheckpointError(f"{file} is damaged: {error!r}") from error
