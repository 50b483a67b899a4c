"""Assembly of an experiment: layout, learner, discriminator, shards, trained policies."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from actors.worker import ShardLike
from console.run import mixing
from console.run.arrivals import arrivals_of
from console.run.directory import RunDirectory, checkpoint_folder
from console.run.experiment import Experiment, experiment_from_json, to_json
from console.run.nan_dump import NanDump
from console.run.policy_teachers import PolicyTeacher, policy_teachers
from console.run.rollouts import rollouts_of
from console.terminal import doing
from discriminator.process import ServiceSpec
from discriminator.protocols import Holding, MocapSampler
from discriminator.trainer import Discriminator
from learner.ppo import Learner
from policy.checkpoints import lineage
from policy.checkpoints.format import Layout, Manifest, read
from policy.checkpoints.lineage import Origin
from policy.errors import CheckpointError
from rpc.server import ServerConfig
from world import tasks
from world.character.features import OBJECT, STATE
from world.character.model import JOINTS, NU
from world.config import WorldConfig
from world.device import CPU
from world.episodes.mixed import MixedShard
from world.episodes.shard import Shard
from world.furniture.piece import Piece
from world.meshes import collection
from world.motions import load
from world.motions.library import MixedSource, MotionLibrary, StyleMixture, StyleSource
from world.objects.bank import ObjectBank
from world.refusals import reason
from world.scene.warp_config import DEFAULT, WarpConfig
from world.tasks import Task
from world.tasks.mixture import Mixture
from world.tasks.symmetry import symmetry
from world.teachers.teacher import Teacher
from world.tracking.arrivals import Arrivals
from world.tracking.rollouts import Rollouts


@doing("reading clips")
def library(
    motions: tuple[str, ...],
    mirror: bool,
    task: str = "sit",
    playback_speeds: tuple[float, ...] = (),
) -> MotionLibrary:
    """Return the clips of a configuration as tensors; read once per process."""
    return load.cached_library(motions, mirror, tasks.make(task).affordance.clips, playback_speeds)


def library_of(world: WorldConfig) -> MotionLibrary:
    """Return the clips of a world's configuration."""
    return library(world.motions, world.mirror, world.task, world.playback_speeds)


@lru_cache(maxsize=2)
@doing("building the objects")
def training_bank(world: WorldConfig) -> ObjectBank:
    """Return the training objects of a configuration, compiled once per process."""
    affordance = tasks.make(world.task).affordance
    bank = affordance.bank(world)
    if not world.track.goal:
        return bank
    return affordance.showing(world, bank, tasks.make(world.track.goal).affordance.clips)


def training_pieces(world: WorldConfig) -> tuple[tuple[Piece, ...], str]:
    """Return the training furniture, and a line on pieces that the task cannot use, or "".

    Raises PieceError for a path without pieces, or without any that the task can use; ConfigError
    for furniture that is held out, or for a task without furniture.
    """
    return tasks.make(world.task).affordance.pieces(world)


def layout(experiment: Experiment) -> Layout:
    """Return the layout of this experiment's checkpoints."""
    task, mixed = tasks.make(experiment.world.task), mixing.mixture_of(experiment)
    goal = task.goal if mixed is None else mixed.goal
    return Layout(
        task=task.name,
        features=tuple((f.name, f.width) for f in STATE),
        goal=tuple((f.name, f.width) for f in goal),
        actions=NU,
        hidden=tuple(experiment.ppo.hidden),
        skip=experiment.ppo.skip,
    )


def learner(experiment: Experiment, device: torch.device = CPU) -> Learner:
    """Return a new learner."""
    mixed, width = mixing.mixture_of(experiment), layout(experiment).observation
    if mixed is None:
        sides, hidden = symmetry(tasks.make(experiment.world.task)), None
    else:
        sides, hidden = mixed.symmetry, mixing.hidden_columns(mixed)
    ppo, seed = experiment.ppo, experiment.seed
    return Learner(width, NU, ppo, seed, symmetry=sides, device=device, hidden=hidden)


@dataclass(frozen=True)
class MakeShard:
    """Factory of an experiment's shards; it can be pickled and sent to another process."""

    world: WorldConfig
    seed: int
    recordings: Path
    simulator: str = "mujoco"
    device: torch.device = CPU
    warp: WarpConfig = DEFAULT
    mixed: Mixture | None = None
    block: int = 64
    """Scenes in which a mixture has its shares."""
    taught: Mapping[str, PolicyTeacher] = field(default_factory=dict)
    """Of some tasks: the policies that label their scenes."""
    arrivals: Arrivals | None = None
    """Initial states of tracking; see world.track.walker."""
    rollouts: Rollouts | None = None
    """Likewise; see world.track.rollouts."""

    def __call__(self, scenes: range) -> ShardLike:
        torch.set_num_threads(1)
        if self.mixed is None:
            return self._part(self.world, scenes)
        parts, places = [], []
        for k, world in enumerate(self.mixed.worlds(self.world)):
            own = self.mixed.scenes(k, scenes, self.block)
            parts.append(self._part(world, own, self.mixed.shown[k]))
            places.append(torch.tensor(own, device=self.device) - scenes.start)
        return MixedShard(self.mixed, parts, places)

    def _part(
        self, world: WorldConfig, scenes: Sequence[int], shown: Sequence[Task] = ()
    ) -> NanDump:
        taught = self.taught.get(world.task)
        teacher = None
        if taught is not None:
            clips, bank = library_of(world), training_bank(world)
            with doing("adapting the teachers' clips to the objects"):
                teacher = taught.teacher(world, clips, bank, len(scenes))
        made = shard(
            world,
            scenes,
            self.seed,
            self.simulator,
            self.device,
            self.warp,
            shown,
            teacher,
            self.arrivals,
            self.rollouts,
        )
        return NanDump(made, scenes, training_bank(world).pieces, self.recordings)


def shard(
    world: WorldConfig,
    scenes: Sequence[int],
    seed: int,
    simulator: str = "mujoco",
    device: torch.device = CPU,
    warp: WarpConfig = DEFAULT,
    shown: Sequence[Task] = (),
    teacher: Teacher | None = None,
    arrivals: Arrivals | None = None,
    rollouts: Rollouts | None = None,
) -> Shard:
    """Return a shard on the clips and furniture of this process.

    shown: tasks whose goals are observed; see Shard. arrivals, rollouts: states from
    which scenes that follow clips are joined too.
    """
    bank = training_bank(world)
    if arrivals is not None or rollouts is not None:
        bank = tasks.make(world.task).affordance.joined_from(bank, arrivals, rollouts)
    library = library_of(world)
    return Shard(world, library, bank, scenes, seed, teacher, simulator, device, warp, shown)


def make_shard(experiment: Experiment, run: RunDirectory, device: torch.device = CPU) -> MakeShard:
    """Return the shard factory of a run; NaN dumps go into the run's recordings.

    device: of the scenes of mujoco-warp; those of MuJoCo are on the CPU.
    """
    return MakeShard(
        experiment.world,
        experiment.seed,
        run.recordings.resolve(),
        experiment.simulator,
        device if experiment.simulator == "warp" else CPU,
        experiment.warp,
        mixing.mixture_of(experiment),
        experiment.block,
        policy_teachers(experiment, trained),
        arrivals_of(experiment, trained),
        rollouts_of(experiment, trained, training_bank),
    )


def mocap(experiment: Experiment) -> MocapSampler:
    """Return the mocap transitions that train the discriminator; of a mixture, of its tasks by
    their shares."""
    mixed, seed, window = mixing.mixture_of(experiment), experiment.seed, experiment.style.window
    if mixed is None:
        return StyleSource(library_of(experiment.world), seed, StyleMixture(), window)
    parts = zip(mixed.parts, mixed.worlds(experiment.world), mixed.counts, strict=True)
    styled = [(w, count) for part, w, count in parts if not part.affordance.follows_clips]
    sources = [StyleSource(library_of(w), seed, StyleMixture(), window) for w, _ in styled]
    return MixedSource(sources, [float(count) for _, count in styled])


def mocap_of(experiment: dict[str, Any]) -> MocapSampler:
    """Return the mocap transitions of an experiment's JSON, in the style service's process."""
    return mocap(experiment_from_json(experiment))


def style_service(
    experiment: Experiment, server: ServerConfig | None = None, state: str = ""
) -> ServiceSpec:
    """Return the style service of an experiment; `state`: folder of its journal, or ""."""
    return ServiceSpec(
        mocap=f"{__name__}:{mocap_of.__name__}",
        arguments={"experiment": to_json(experiment)},
        style=experiment.style,
        seed=experiment.seed,
        object_mask=object_mask().tolist(),
        holding=holding().to_json(),
        coarse=coarse().tolist(),
        server=server or ServerConfig(),
        state=state,
    )


def object_mask() -> Tensor:
    """Return the mask [114] bool of the features that describe the object."""
    mask = torch.zeros(STATE.width, dtype=torch.bool)
    mask[OBJECT] = True
    return mask


def coarse() -> Tensor:
    """Return the mask [114] bool of the features that clips show coarsely: the object's rotation,
    which is inferred, or constant."""
    mask = torch.zeros(STATE.width, dtype=torch.bool)
    mask[STATE.slice("object_rotation")] = True
    return mask


def discriminator(
    experiment: Experiment, replay: Path | None = None, device: torch.device = CPU
) -> Discriminator:
    """Return the discriminator in this process; replay: file of its replay buffer."""
    source, mask = mocap(experiment), object_mask()
    return Discriminator(
        experiment.style,
        source,
        experiment.seed,
        mask,
        replay,
        device=device,
        record=experiment.ppo.record,
        holding=holding(),
        coarse=coarse(),
    )


#: Both hands are this near to the centre of a box in hand, m: half of the widest one, 0.5 m at size
#: 1.5, and a hand.
_HELD_M = 0.42
_ARMS = ("shoulder", "elbow", "hand")


def holding() -> Holding:
    """Return how a box in hand is told from a state, and what of it the arms are."""
    hidden = torch.zeros(STATE.width, dtype=torch.bool)
    for feature in STATE:
        if any(part in feature.name for part in _ARMS):
            hidden[STATE.slice(feature.name)] = True
    first, at = STATE.slice("joint_velocity").start, 0
    for joint in JOINTS:
        if any(part in joint.name for part in _ARMS):
            hidden[first + at : first + at + len(joint.range_deg)] = True
        at += len(joint.range_deg)
    columns = torch.arange(STATE.width)
    hands = [columns[STATE.slice(f"position_{side}_hand")] for side in ("right", "left")]
    box = columns[STATE.slice("object_position")]
    return Holding(torch.stack(hands), box, _HELD_M, hidden)


def notes(experiment: Experiment, inherited: Sequence[Origin] = ()) -> dict[str, str]:
    """Return the notes of a checkpoint: its experiment, data and licences. With them it can be used
    without its run's config.json.

    inherited: origins of the checkpoint that the training begins from.
    """
    found = (*origins(experiment), *inherited)
    licences = sorted({origin.licence for origin in found})
    return {
        "experiment": json.dumps(to_json(experiment)),
        "data_licences": "; ".join(licences),
        lineage.NOTE: lineage.note(found),
    }


OWN_CLIPS = "the package's synthetic clips"


def origins(experiment: Experiment) -> tuple[Origin, ...]:
    """Return the clips and imported pieces of an experiment with their licences, one for each
    licence."""
    world = experiment.world
    named = f"clips of {', '.join(Path(path).name for path in world.motions)}"
    clips = [clip for one in mixing.worlds(experiment) for clip in library_of(one).clips]
    found = [Origin(named if world.motions else OWN_CLIPS, clip.licence) for clip in clips]
    for name in world.objects:
        if name in collection.SPLITS:
            continue  # the package's own furniture, under the package's licence
        found += [
            Origin(f"furniture of {Path(name).name}", piece.licence, piece.credit)
            for piece in collection.pieces((name,))
        ]
    return tuple(dict.fromkeys(found))


@dataclass(frozen=True)
class Trained:
    """A policy read from a checkpoint, with its experiment."""

    path: Path
    manifest: Manifest
    experiment: Experiment
    weights: dict[str, Tensor]

    @property
    def task(self) -> str:
        return self.manifest.layout.task


@doing("reading the policy")
def trained(source: Path, task: str = "") -> Trained:
    """Return the policy of a run or checkpoint.

    task: of a mixture's tasks, the one that the policy is for; default: its first.

    Raises ConfigError for a task that the policy was not trained for, LayoutError for a policy of
    other features or goals, CheckpointError for a damaged checkpoint, RunError without any.
    """
    path = checkpoint_folder(source)
    found = read(path, ("policy",))
    experiment = experiment_of(found.manifest, path)
    layout(experiment).require(found.manifest.layout, str(path))
    experiment, state = mixing.of_one_task(experiment, found.state["policy"], task)
    actor = learner(experiment)
    actor.load_policy_state(state)
    weights = actor.averaged_weights()
    actor.close()
    manifest = replace(found.manifest, layout=layout(experiment))
    return Trained(path, manifest, experiment, weights)


def experiment_of(manifest: Manifest, path: Path) -> Experiment:
    """Return the experiment of a checkpoint, from its notes."""
    try:
        return experiment_from_json(json.loads(manifest.notes["experiment"]), str(path))
    except (KeyError, ValueError, TypeError) as error:
        raise CheckpointError(f"{path} records no valid experiment ({reason(error)})") from error
