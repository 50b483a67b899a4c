"""Mixtures: shares of the scenes, the union of the goals by name, and what the policy sees."""

import pytest
import torch

from world import tasks
from world.character.features import STATE
from world.config import WorldConfig
from world.errors import ChoiceError, ConfigError
from world.tasks.mixture import MARK, is_mixed, mixture, shares
from world.tasks.symmetry import symmetry

ALL = {"carry": 1.0, "track": 1.0, "sit": 2.0}


def test_shares_become_whole_scenes_of_every_block() -> None:
    found = mixture(ALL, 64)
    assert found.counts == (16, 16, 32)
    assert mixture({"sit": 1.0, "lie": 1.0, "walk": 1.0}, 64).counts in {(22, 21, 21)}
    block = [found.scenes(part, range(64, 192), 64) for part in range(3)]
    assert block[0] == [*range(64, 80), *range(128, 144)]
    assert sorted(scene for part in block for scene in part) == list(range(64, 192))


@pytest.mark.parametrize(
    ("mix", "task", "words"),
    [
        (["sit=0.5"], "sit", "two tasks or more"),
        (["sit=0.5", "lie"], "sit", "--mix lie: write each task once"),
        (["sit=0.5", "lie=-1"], "sit", "--mix lie=-1"),
        (["sit=0.5", "lie=nan"], "sit", "--mix lie=nan"),
        (["sit=0.5", "sit=0.5"], "sit", "--mix sit=0.5"),
        (["sit=0.5", "lie=0.5"], "carry", "add carry=SHARE"),
        (["sit=1", "lie=1e-9"], "sit", "less than one scene"),
    ],
)
def test_shares_that_cannot_be(mix: list[str], task: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        mixture(shares(mix, task), 64)


def test_an_unknown_task_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(ChoiceError, match=r"swim.*carry, lie, sit, track, walk"):
        shares(["swim=1"], "swim")


def test_what_is_trained_comes_first() -> None:
    assert list(shares(["track=0.5", "carry=0.5"], "carry")) == ["carry", "track"]
    assert shares([], "carry") == {}


def test_features_of_equal_meaning_share_their_columns() -> None:
    found = mixture({"sit": 1.0, "carry": 1.0, "walk": 1.0}, 64)
    names = [feature.name for feature in found.goal]
    assert len(names) == len(set(names))
    # by Carry.equivalents: its box is where one walks to; its own target is another thing
    sit, carry, walk = found.columns
    assert sit[:3].tolist() == carry[:3].tolist() == walk[:3].tolist()
    assert "carry_target" in names and "carry_corners" in names
    assert not set(carry[3:].tolist()) & set(sit.tolist())
    assert not found.hidden.any()
    assert is_mixed([(f.name, f.width) for f in found.goal])
    assert not is_mixed([(f.name, f.width) for f in tasks.make("sit").goal])
    assert found.equivalents("carry")["target"] == "box"
    assert found.equivalents("sit")["carry_target"] == ""


def test_a_goal_is_embedded_with_the_mark_of_its_task() -> None:
    found = mixture(ALL, 64)
    goals = torch.randn(5, tasks.make("sit").goal.width)
    rows = found.embed(2, goals)
    assert torch.equal(rows[:, found.own("sit")], goals)
    marks = {name: rows[:, found.goal.slice(MARK + name)].unique().tolist() for name in ALL}
    assert marks == {"carry": [0.0], "track": [0.0], "sit": [1.0]}
    rest = torch.ones(found.goal.width, dtype=torch.bool)
    rest[found.own("sit")] = False
    assert int(rows[:, rest].count_nonzero()) == 5  # the marks alone


def test_a_shown_goal_hides_the_reference_from_the_policy_alone() -> None:
    found = mixture({"carry": 1.0, "track": 1.0}, 64, shown="carry")
    track, carry = tasks.make("track"), tasks.make("carry")
    assert [t.name for t in found.shown[1]] == ["carry", "track"]
    goals = torch.randn(4, carry.goal.width + track.goal.width)
    rows = found.embed(1, goals)
    assert torch.equal(rows[:, found.own("carry")], goals[:, : carry.goal.width])
    # to the policy the scene looks like one of carry; the critic can tell it
    seen = rows[:, ~found.hidden]
    assert torch.equal(seen, found.embed(0, goals[:, : carry.goal.width])[:, ~found.hidden])
    assert bool((rows[:, found.goal.slice(f"{MARK}track")] == 1.0).all())
    assert int(found.hidden.sum()) == track.goal.width + 1
    with pytest.raises(ConfigError, match="never sees the goal of track: choose carry"):
        found.own("track")
    with pytest.raises(ConfigError, match="not in the mixture: choose carry, track"):
        found.number("sit")


def test_only_a_task_of_the_mixture_is_shown() -> None:
    with pytest.raises(ConfigError, match="needs the tasks track and sit"):
        mixture({"carry": 1.0, "track": 1.0}, 64, shown="sit")
    with pytest.raises(ConfigError, match="other than track"):
        mixture({"carry": 1.0, "track": 1.0}, 64, shown="track")


def test_reflections_are_those_of_the_tasks() -> None:
    found = mixture(ALL, 64)
    mirror = found.symmetry.observation
    for number, name in enumerate(ALL):
        task = tasks.make(name)
        state, goal = torch.randn(3, STATE.width), torch.randn(3, task.goal.width)
        alone = symmetry(task).observation(torch.cat((state, goal), dim=1))
        whole = mirror(torch.cat((state, found.embed(number, goal)), dim=1))
        assert torch.equal(whole[:, : STATE.width], alone[:, : STATE.width])
        assert torch.equal(whole[:, STATE.width :][:, found.own(name)], alone[:, STATE.width :])
    rows = torch.randn(3, STATE.width + found.goal.width)
    assert torch.equal(mirror(mirror(rows)), rows)
    assert found.symmetry.sides is None


def test_every_task_has_episodes_of_its_own_length() -> None:
    found = mixture({"sit": 1.0, "carry": 1.0}, 64)
    sit, carry = found.worlds(WorldConfig(task="sit", episode_s=4.0))
    assert (sit.task, sit.episode_s) == ("sit", 4.0)
    assert (carry.task, carry.episode_s) == ("carry", tasks.make("carry").episode_s)
