"""Trained policies as the teachers of a training's scenes."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, cast

from torch import Tensor

from console.run import mixing
from console.run.experiment import Experiment
from policy.model.acting import Policy
from world import tasks
from world.character import features
from world.config import WorldConfig
from world.errors import ConfigError
from world.motions.library import MotionLibrary
from world.objects.bank import ObjectBank
from world.teachers.aligned import AlignedTracker
from world.teachers.boxes import Boxes
from world.teachers.carrying import carrying_walker
from world.teachers.expert import ExpertTeacher
from world.teachers.seated import SeatedTracker
from world.teachers.teacher import Teacher
from world.teachers.tracker import TrackerTeacher
from world.teachers.walker import WalkerTeacher

#: Tasks whose scenes a policy that walks, or one of the task itself, teaches; those that one that
#: follows clips does.
WALKERS, HANDLERS = ("sit", "lie", "carry"), ("sit", "carry")


class Trained(Protocol):
    """What a teacher needs of a trained policy."""

    @property
    def task(self) -> str: ...
    @property
    def experiment(self) -> Experiment: ...
    @property
    def weights(self) -> dict[str, Tensor]: ...


@dataclass(frozen=True)
class Weights:
    """A trained policy and its world; it can be sent to another process."""

    world: WorldConfig
    weights: dict[str, Tensor]

    def policy(self) -> Policy:
        """Return the policy."""
        return Policy(self.weights)


@dataclass(frozen=True)
class PolicyTeacher:
    """Trained policies that label the scenes of one task, by what they teach: to follow a reference
    (tracker), to walk to an object (walker), to use it as in a clip (handler), and what these leave
    open (expert)."""

    policies: Mapping[str, Weights]

    def teacher(
        self, world: WorldConfig, library: MotionLibrary, bank: ObjectBank, scenes: int
    ) -> Teacher:
        """Return the teacher of a shard of `scenes` scenes.

        Raises ClipError where the library's clips do not show what a tracker is to teach.
        """
        if (tracker := self.policies.get("tracker")) is not None:
            return TrackerTeacher(tracker.policy(), tracker.world.track.residual)
        first = self._of_parts(world, library, bank, scenes)
        if (expert := self.policies.get("expert")) is not None:
            return ExpertTeacher(expert.policy(), tasks.make(world.task), first)
        assert first is not None, "a teacher has a policy"
        return first

    def _of_parts(
        self, world: WorldConfig, library: MotionLibrary, bank: ObjectBank, scenes: int
    ) -> Teacher | None:
        """Return the teacher that labels the parts of the task by walker and handler, if any."""
        walker = self.policies.get("walker")
        walks = None if walker is None else WalkerTeacher(walker.policy())
        if (handler := self.policies.get("handler")) is not None:
            act, residual = handler.policy(), handler.world.track.residual
            if not tasks.make(world.task).affordance.clips.holds:
                return SeatedTracker(act, residual, library.clips, scenes, walks)
            boxes, stands, clips = cast("Boxes", bank), world.carry.stand_m, library.clips
            carrying = None
            if walker is not None:
                usual = walker.weights["normaliser.mean"][: features.STATE.width]
                carrying = carrying_walker(walker.policy(), usual, clips, boxes)
            return AlignedTracker(act, residual, clips, boxes, stands, scenes, walks, carrying)
        return walks


def policy_teachers(
    experiment: Experiment, trained: Callable[[Path], Trained]
) -> dict[str, PolicyTeacher]:
    """Return the trained policies that label an experiment's scenes, by the task of the scenes.

    trained: reads a run, checkpoint or name. Raises ConfigError for a policy of another task, or of
    other actions; and as `trained`.
    """
    found: dict[str, dict[str, Weights]] = {}
    world = experiment.world
    here = {part.task for part in mixing.worlds(experiment)}
    for flag, names, source, wanted, name in (
        ("--world.track.teacher", ("track",), world.track.teacher, "track", "tracker"),
        ("--world.walker", WALKERS, world.walker, "walk", "walker"),
        ("--world.tracker", HANDLERS, world.tracker, "track", "handler"),
        ("--world.expert", WALKERS, world.expert, "", "expert"),
    ):
        if not source:
            continue
        taught = [task for task in names if task in here]
        if not taught:
            raise ConfigError(
                f"{flag} {source}: no scene here has the task {' or '.join(names)}: leave it out"
            )
        for task in taught:
            one = required(flag, source, wanted or task, world, trained)
            theirs = one.experiment.world
            found.setdefault(task, {})[name] = Weights(theirs, one.weights)
    return {task: PolicyTeacher(policies) for task, policies in found.items()}


def beginning(
    flag: str,
    source: str,
    task: str,
    experiment: Experiment,
    trained: Callable[[Path], Trained],
) -> Trained | None:
    """Return the policy of a task in whose states an experiment's tracking begins, by the flag that
    names it; None without one. Raises ConfigError where nothing is tracked, and as `required`."""
    if not source:
        return None
    if not followers(experiment):
        raise ConfigError(f"{flag} {source}: no scene here has the task track: leave it out")
    return required(flag, source, task, experiment.world, trained)


def followers(experiment: Experiment) -> list[WorldConfig]:
    """Return the worlds of an experiment that follow clips."""
    worlds = mixing.worlds(experiment)
    return [world for world in worlds if tasks.make(world.task).affordance.follows_clips]


def required(
    flag: str, source: str, task: str, world: WorldConfig, trained: Callable[[Path], Trained]
) -> Trained:
    """Return the policy that a flag names; ConfigError where it is of another task, or of other
    actions than those of `world`."""
    one = trained(Path(source))
    if one.task != task:
        raise ConfigError(
            f"{flag} {source} is a policy of the task {one.task}: name a run or checkpoint of"
            f" the task {task}"
        )
    theirs = one.experiment.world
    if (theirs.action_scale, theirs.action_clip) != (world.action_scale, world.action_clip):
        raise ConfigError(
            f"{flag} {source} was trained with --world.action-scale {theirs.action_scale:g}"
            f" --world.action-clip {theirs.action_clip:g}: give the same"
        )
    return one
