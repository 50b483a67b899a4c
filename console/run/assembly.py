"""Puts an experiment together: layout, learner, style, shards and the fleets of both runners."""

import json
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from actors.worker import ShardLike
from console.run.directory import RunDirectory, checkpoint_folder
from console.run.experiment import Experiment, experiment_from_json, to_json
from console.run.nan_dump import BlackBox
from discriminator.process import ServiceSpec
from discriminator.service import ServiceConfig
from discriminator.trainer import Discriminator
from learner.ppo import Learner
from policy.checkpoints.format import Layout, Manifest, read
from policy.errors import CheckpointError
from rpc.server import ServerConfig
from world import tasks, teachers
from world.character.features import OBJECT, STATE
from world.character.model import NU
from world.config import WorldConfig
from world.episodes.shard import Shard
from world.furniture.piece import Piece
from world.motions import load
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.objects.bank import ObjectBank
from world.tasks.symmetry import symmetry


@lru_cache(maxsize=2)
def library(
    motions: tuple[str, ...],
    mirror: bool,
    task: str = "sit",
    playback_speeds: tuple[float, ...] = (),
) -> MotionLibrary:
    """The clips of a configuration as tensors; read once in a process."""
    return load.library(motions, mirror, tasks.make(task).affordance.clips, playback_speeds)


def library_of(world: WorldConfig) -> MotionLibrary:
    """The clips of a world's configuration."""
    return library(world.motions, world.mirror, world.task, world.playback_speeds)


@lru_cache(maxsize=2)
def training_bank(world: WorldConfig) -> ObjectBank:
    """The training objects of a configuration, compiled once in a process."""
    return tasks.make(world.task).affordance.bank(world)


def training_pieces(world: WorldConfig) -> tuple[tuple[Piece, ...], str]:
    """The furniture to train on, and a line on what of it the task cannot use, if anything.

    Raises PieceError for a path without pieces, or where none has a place for the task;
    ConfigError for furniture that is held out, or for a task that uses none.
    """
    return tasks.make(world.task).affordance.pieces(world)


def layout(experiment: Experiment) -> Layout:
    """What a checkpoint of this experiment holds."""
    task = tasks.make(experiment.world.task)
    return Layout(
        task=task.name,
        features=tuple((f.name, f.width) for f in STATE),
        goal=tuple((f.name, f.width) for f in task.goal),
        actions=NU,
        hidden=tuple(experiment.ppo.hidden),
        skip=experiment.ppo.skip,
    )


def learner(experiment: Experiment) -> Learner:
    """A fresh learner."""
    sides = symmetry(tasks.make(experiment.world.task))
    return Learner(
        layout(experiment).observation, NU, experiment.ppo, experiment.seed, symmetry=sides
    )


@dataclass(frozen=True)
class MakeShard:
    """Shards of one experiment, wherever they are made: it can be sent to another process."""

    world: WorldConfig
    seed: int
    recordings: Path

    def __call__(self, scenes: range) -> ShardLike:
        torch.set_num_threads(1)
        pieces = training_bank(self.world).pieces
        return BlackBox(shard(self.world, scenes, self.seed), scenes, pieces, self.recordings)


def shard(world: WorldConfig, scenes: range, seed: int) -> Shard:
    """A shard on this process's clips and furniture."""
    bank = training_bank(world)
    teacher = teachers.make(world, bank, scenes)
    return Shard(world, library_of(world), bank, scenes, seed, teacher)


def make_shard(experiment: Experiment, run: RunDirectory) -> MakeShard:
    """The shard factory of a run, where blow-ups are written down."""
    return MakeShard(experiment.world, experiment.seed, run.recordings.resolve())


def mocap(experiment: Experiment) -> StyleSource:
    """The transitions that the discriminator takes for real."""
    return StyleSource(library_of(experiment.world), experiment.seed, StyleMixture())


def mocap_of(experiment: dict[str, Any]) -> StyleSource:
    """As `mocap`, of an experiment's JSON: what the style service's process calls."""
    return mocap(experiment_from_json(experiment))


def style_service(
    experiment: Experiment, server: ServerConfig | None = None, state: str = ""
) -> ServiceSpec:
    """The style service of an experiment; `state`: folder of its journal, if any."""
    return ServiceSpec(
        mocap=f"{__name__}:{mocap_of.__name__}",
        arguments={"experiment": to_json(experiment)},
        style=experiment.style,
        seed=experiment.seed,
        object_mask=object_mask().tolist(),
        server=server or ServerConfig(),
        service=ServiceConfig(state=state),
    )


def object_mask() -> Tensor:
    """[114] bool: which features describe the object."""
    mask = torch.zeros(STATE.width, dtype=torch.bool)
    mask[OBJECT] = True
    return mask


def discriminator(experiment: Experiment, replay: Path | None = None) -> Discriminator:
    """The style reward in this process."""
    return Discriminator(
        experiment.style, mocap(experiment), experiment.seed, object_mask(), replay
    )


def notes(experiment: Experiment) -> dict[str, str]:
    """What a checkpoint says of itself, so that it stands without its run's config.json."""
    clips = library_of(experiment.world).clips
    licences = sorted({clip.licence for clip in clips})
    return {"experiment": json.dumps(to_json(experiment)), "data_licences": "; ".join(licences)}


@dataclass(frozen=True)
class Trained:
    """A checkpoint, ready to act."""

    path: Path
    manifest: Manifest
    experiment: Experiment
    weights: dict[str, Tensor]

    @property
    def task(self) -> str:
        return self.manifest.layout.task


def trained(source: Path) -> Trained:
    """The policy of a run or checkpoint.

    Raises LayoutError where it was made for other features or goals, CheckpointError where it is
    damaged, RunError where there is none.
    """
    path = checkpoint_folder(source)
    found = read(path, ("policy",))
    experiment = experiment_of(found.manifest, path)
    layout(experiment).require(found.manifest.layout, str(path))
    actor = learner(experiment)
    actor.load_policy_state(found.state["policy"])
    weights = actor.averaged_weights()
    actor.close()
    return Trained(path, found.manifest, experiment, weights)


def experiment_of(manifest: Manifest, path: Path) -> Experiment:
    """The experiment that a checkpoint was made by."""
    try:
        return experiment_from_json(json.loads(manifest.notes["experiment"]), str(path))
    except (KeyError, ValueError, TypeError) as error:
        raise CheckpointError(f"{path} does not say which experiment made it ({error})") from error
