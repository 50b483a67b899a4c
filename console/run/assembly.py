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
from console.run.experiment import Experiment, from_json, to_json
from console.run.nan_dump import BlackBox
from discriminator.process import ServiceSpec
from discriminator.service import ServiceConfig
from discriminator.trainer import Discriminator
from learner.ppo import Learner
from policy.checkpoints.format import Layout, Manifest, read
from policy.errors import CheckpointError
from rpc.server import ServerConfig
from world import tasks
from world.character.features import OBJECT, STATE
from world.character.model import NU
from world.config import WorldConfig
from world.episodes.shard import Shard
from world.errors import ConfigError
from world.furniture import collection
from world.furniture.bands import Split
from world.furniture.catalogue import catalogue
from world.furniture.piece import Affordance, Piece
from world.motions import load
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.motions.reference import reference
from world.objects.box_bank import BoxBank, boxes
from world.objects.furniture_bank import Bank, variants
from world.objects.track_bank import TrackBank
from world.tasks.symmetry import symmetry
from world.tasks.track import follows


@lru_cache(maxsize=2)
def library(
    motions: tuple[str, ...], mirror: bool, task: str = "sit", paces: tuple[float, ...] = ()
) -> MotionLibrary:
    """The clips of a configuration as tensors; read once in a process."""
    return load.library(motions, mirror, task, paces)


def library_of(world: WorldConfig) -> MotionLibrary:
    """The clips of a world's configuration."""
    return library(world.motions, world.mirror, world.task, world.paces)


@lru_cache(maxsize=2)
def training_bank(world: WorldConfig) -> Bank | BoxBank | TrackBank:
    """The training furniture or boxes of a configuration, compiled once in a process."""
    affordance = tasks.make(world.task).affordance
    if follows(tasks.make(world.task)):
        clips = library_of(world).clips
        return TrackBank(clips, reference(clips, world.track.handling), world.track)
    if affordance == "carry":
        return BoxBank(boxes(world.carry))
    return Bank(variants(training_pieces(world)[0], world.scales, world.scale), affordance)


def training_pieces(world: WorldConfig) -> tuple[tuple[Piece, ...], str]:
    """The furniture to train on, and a line on what of it the task cannot use, if anything.

    Raises PieceError for a path without pieces, or where none has a place for the task;
    ConfigError for furniture that is held out, or for a task that uses none.
    """
    affordance = tasks.make(world.task).affordance
    if affordance == "carry" or follows(tasks.make(world.task)):
        if world.objects:
            raise ConfigError(f"--objects: {world.task} has its own; leave it out")
        return (), ""
    found: list[Piece] = []
    for name in world.objects or ("train",):
        if name == "train":
            found += pieces_for(affordance, "train", world.pieces, world.seed)
        elif name in collection.SPLITS:
            raise ConfigError(
                f"--objects {name}: the test pieces are held out; choose train or a path"
            )
        else:
            found += collection.pieces([name])
    usable = collection.usable(found, affordance, ", ".join(world.objects))
    taken = {id(piece) for piece in usable}
    idle = [piece.name for piece in found if id(piece) not in taken]
    if not idle:
        return usable, ""
    few = ", ".join(idle[:4]) + (", ..." if len(idle) > 4 else "")
    return usable, f"{len(idle)} of {len(found)} pieces have no place to {affordance}: {few}"


def pieces_for(
    affordance: Affordance, split: Split, count: int | None, seed: int
) -> tuple[Piece, ...]:
    """Pieces of the catalogue that offer what a task needs; of seats, those of the four classes
    that every one is meant to be sat on."""
    return catalogue(split, count, seed, affordance=None if affordance == "sit" else affordance)


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
    return Shard(world, library_of(world), training_bank(world), scenes, seed)


def make_shard(experiment: Experiment, run: RunDirectory) -> MakeShard:
    """The shard factory of a run, where blow-ups are written down."""
    return MakeShard(experiment.world, experiment.seed, run.recordings.resolve())


def mocap(experiment: Experiment) -> StyleSource:
    """The transitions that the discriminator takes for real."""
    return StyleSource(library_of(experiment.world), experiment.seed, StyleMixture())


def mocap_of(experiment: dict[str, Any]) -> StyleSource:
    """As `mocap`, of an experiment's JSON: what the style service's process calls."""
    return mocap(from_json(Experiment, experiment))


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
        return from_json(Experiment, json.loads(manifest.notes["experiment"]), str(path))
    except (KeyError, ValueError, TypeError) as error:
        raise CheckpointError(f"{path} does not say which experiment made it ({error})") from error
