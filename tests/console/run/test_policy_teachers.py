"""Trained policies as teachers: which teacher the flags make, and that it can be sent on."""

import pickle
from dataclasses import replace
from pathlib import Path

import pytest

from console.run import assembly, renamed
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
from world.teachers.expert import ExpertTeacher
from world.teachers.walker import WalkerTeacher

TRACKER, WALKER = (str(ROOT / "pretrained" / name) for name in ("track", "walk"))
WORLD = WorldConfig(task="carry", carry=CarryConfig(sizes=2, scale=(0.6, 0.7)))


def experiment(world: WorldConfig) -> Experiment:
    theirs = assembly.trained(Path(WALKER)).experiment.world
    return Experiment(world=replace(world, action_scale=theirs.action_scale))


def test_the_flags_make_the_teachers() -> None:
    library, bank = MotionLibrary([standing_clip()], use=BOX), BoxBank(boxes(WORLD.carry))
    tracks = replace(WORLD, tracker=TRACKER)
    for world, kind in (
        (replace(WORLD, walker=WALKER), WalkerTeacher),
        (tracks, AlignedTracker),
        (replace(tracks, walker=WALKER), AlignedTracker),
    ):
        found = policy_teachers(experiment(world), assembly.trained)
        assert list(found) == ["carry"]
        sent = pickle.loads(pickle.dumps(found["carry"]))
        teacher = sent.teacher(world, library, bank, 4)
        assert type(teacher) is kind
        if isinstance(teacher, AlignedTracker):
            assert (teacher._walker is not None) == bool(world.walker)


@pytest.mark.parametrize("task", ["sit", "lie"])
def test_a_walker_teaches_what_has_furniture(task: str) -> None:
    found = policy_teachers(experiment(WorldConfig(task=task, walker=WALKER)), assembly.trained)
    assert list(found) == [task]
    assert set(found[task].policies) == {"walker"}


def test_an_expert_is_of_the_task_itself() -> None:
    library, bank = MotionLibrary([standing_clip()], use=BOX), BoxBank(boxes(WORLD.carry))
    theirs = assembly.trained(Path("carry")).experiment.world
    own = replace(WORLD, expert="carry", action_scale=theirs.action_scale)
    for world, kind in ((own, None), (replace(own, walker=WALKER), WalkerTeacher)):
        found = policy_teachers(Experiment(world=world), assembly.trained)["carry"]
        teacher = pickle.loads(pickle.dumps(found)).teacher(world, library, bank, 4)
        assert type(teacher) is ExpertTeacher
        assert type(teacher._first) is (kind or type(None))
    with pytest.raises(ConfigError, match=r"is a policy of the task carry: name .* the task sit"):
        policy_teachers(Experiment(world=replace(own, task="sit")), assembly.trained)


def test_a_renamed_flag_of_an_earlier_version_is_read() -> None:
    old = {"world": {"task": "carry", "carry": {"walker": "walk"}}}
    assert renamed.current(old)["world"]["walker"] == "walk"


def test_what_cannot_teach_is_refused() -> None:
    for world, said in (
        (replace(WORLD, tracker=WALKER), "is a policy of the task walk"),
        (replace(WORLD, walker=TRACKER), "is a policy of the task track"),
        (replace(WORLD, task="walk", walker=WALKER), "no scene here has the task sit or lie or"),
        (replace(WORLD, track=TrackConfig(teacher=TRACKER)), "no scene here has the task track"),
    ):
        with pytest.raises(ConfigError, match=said):
            policy_teachers(experiment(world), assembly.trained)
    other = experiment(replace(WORLD, walker=WALKER))
    with pytest.raises(ConfigError, match=r"was trained with --world\.action-scale"):
        scaled = replace(other.world, action_scale=0.5 * other.world.action_scale)
        policy_teachers(replace(other, world=scaled), assembly.trained)
