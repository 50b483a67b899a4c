"""Trained policies as teachers: which teacher the flags make, and that it can be sent on."""

import pickle
from dataclasses import replace
from pathlib import Path

import pytest

from console.run import assembly
from console.run.experiment import Experiment
from console.run.policy_teachers import policy_teachers
from tests.support.paths import ROOT
from tests.support.world.standing_clip import standing_clip
from world.config import CarryConfig, TrackConfig, WorldConfig
from world.errors import ConfigError
from world.motions.library import MotionLibrary
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.teachers.aligned import AlignedTracker
from world.teachers.walker import WalkerTeacher

TRACKER, WALKER = (str(ROOT / "pretrained" / name) for name in ("track", "walk"))
WORLD = WorldConfig(task="carry", carry=CarryConfig(sizes=2, scale=(0.6, 0.7)))


def experiment(world: WorldConfig) -> Experiment:
    theirs = assembly.trained(Path(WALKER)).experiment.world
    return Experiment(world=replace(world, action_scale=theirs.action_scale))


def test_the_flags_make_the_teachers() -> None:
    library, bank = MotionLibrary([standing_clip()], use=BOX), BoxBank(boxes(WORLD.carry))
    walks = replace(WORLD.carry, walker=WALKER)
    for carry, kind in (
        (walks, WalkerTeacher),
        (replace(WORLD.carry, tracker=TRACKER), AlignedTracker),
        (replace(walks, tracker=TRACKER), AlignedTracker),
    ):
        world = replace(WORLD, carry=carry)
        found = policy_teachers(experiment(world), assembly.trained)
        assert list(found) == ["carry"]
        sent = pickle.loads(pickle.dumps(found["carry"]))
        teacher = sent.teacher(world, library, bank, 4)
        assert type(teacher) is kind
        if isinstance(teacher, AlignedTracker):
            assert (teacher._walker is not None) == bool(carry.walker)


def test_what_cannot_teach_is_refused() -> None:
    for world, said in (
        (replace(WORLD, carry=CarryConfig(tracker=WALKER)), "is a policy of the task walk"),
        (replace(WORLD, carry=CarryConfig(walker=TRACKER)), "is a policy of the task track"),
        (replace(WORLD, track=TrackConfig(teacher=TRACKER)), "no scene here has the task track"),
    ):
        with pytest.raises(ConfigError, match=said):
            policy_teachers(experiment(world), assembly.trained)
    other = experiment(replace(WORLD, carry=CarryConfig(walker=WALKER)))
    with pytest.raises(ConfigError, match=r"was trained with --world\.action-scale"):
        scaled = replace(other.world, action_scale=0.5 * other.world.action_scale)
        policy_teachers(replace(other, world=scaled), assembly.trained)
