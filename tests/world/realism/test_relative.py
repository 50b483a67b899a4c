"""Measures relative to held-out mocap: a control of more of the same, and a control with noise."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import torch

from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.motions.synthetic import library
from world.realism import phases, relative
from world.realism.measures import Motion


@pytest.fixture(scope="module")
def walks() -> list[Clip]:
    generator = np.random.default_rng(3)
    speeds = np.linspace(0.8, 1.4, 10)
    return [
        replace(library.curving(generator, float(speed), 1 if i % 2 else -1), name=f"walk {i}")
        for i, speed in enumerate(speeds)
    ]


def test_more_of_the_same_is_about_1_and_noise_is_far_from_it(walks: list[Clip]) -> None:
    names = [clip.name for clip in walks]
    rest, control = walks[:8], walks[8:]
    same = relative.compare(control, rest, names[:8], folds=1)["all"]
    shaken = relative.compare(phases.noised(control, 0.01), rest, names[:8], folds=1)["all"]
    for name in ("jerk", "walking_speed"):
        ratio = same.values[name].ratio
        assert ratio is not None and 0.6 < ratio < 1.6, name
    for name, factor in (("jerk", 5.0), ("skating", 2.0), ("frechet", 3.0)):
        noise, value = shaken.values[name].motion, same.values[name].motion
        assert noise is not None and value is not None and noise > factor * value, name
    auc = shaken.values["separability"].motion
    covered = [each.values["coverage"].motion for each in (shaken, same)]
    assert auc is not None and auc > 0.95
    assert covered[0] == 0.0 and covered[1] is not None and covered[1] > 0.5
    assert same.seconds[0] == pytest.approx(sum(clip.seconds for clip in control))
    seconds = sum(clip.seconds for clip in rest)
    assert same.seconds[1] + same.seconds[2] == pytest.approx(seconds)
    contact = relative.compare(control[:1], rest[:4], names[:4], folds=1)["contact"]
    assert contact.values["jerk"] == relative.Value(None, None, 0.5)


def test_groups_are_held_out_whole(walks: list[Clip], monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[set[str], set[str]]] = []
    split = relative.phases.by_phase

    def watched(clips: Sequence[Clip]):
        seen.append(({clip.name for clip in clips}, set()))
        return split(clips)

    monkeypatch.setattr(relative.phases, "by_phase", watched)
    groups = ["a", "a", "b", "b", "c", "c", "d", "d"]
    monkeypatch.setattr(relative.comparison, "separability", lambda *sets: 0.5)
    relative.compare(walks[8:], walks[:8], groups, folds=3)
    by_group = [{f"walk {2 * i}", f"walk {2 * i + 1}"} for i in range(4)]
    for names, _ in seen[1:]:
        assert all(group <= names or not group & names for group in by_group)
        assert len(names) == 4
    with pytest.raises(ClipError, match="3 recordings to compare with: at least 4"):
        relative.compare(walks[8:], walks[:8], ["a", "b", "c", "c"] * 2)


def test_there_is_no_ratio_to_next_to_nothing(
    walks: list[Clip], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Clips that stand have less of a measure than it resolves; those that walk have more."""
    still = [
        replace(
            clip,
            root_position_m=np.repeat(clip.root_position_m[:1], 40, axis=0),
            local_rotation=np.repeat(clip.local_rotation[:1], 40, axis=0),
        )
        for clip in walks[:4]
    ]
    names = [clip.name for clip in still]
    monkeypatch.setattr(relative.comparison, "separability", lambda *sets: 0.5)
    found = relative.compare(walks[4:5], still, names, folds=1)["all"].values
    for name in ("skating", "jerk"):
        motion, reference = found[name].motion, found[name].mocap
        assert motion is not None and motion > found[name].least > 0.0, name
        assert reference is not None and reference < found[name].least, name
        assert found[name].ratio is None, name
    assert relative.Value(0.05, 0.01, 0.01).ratio is None
    assert relative.Value(0.05, 0.02, 0.01).ratio == pytest.approx(2.5)


def test_depth_below_the_floor_and_speed_of_a_walk() -> None:
    qpos = torch.from_numpy(character.standing_qpos()).repeat(30, 1)
    low = qpos.clone()
    low[:, 2] -= 0.02
    still = torch.zeros(30, character.NV)
    standing = relative.penetration_m([Motion(qpos, still)])
    assert relative.penetration_m([Motion(low, still)]) - standing == pytest.approx(0.02, abs=2e-3)
    assert relative.walking_speed_m_s([Motion(qpos, still)]) is None
    walking = still.clone()
    walking[:20, 0], walking[:20, 1] = 0.6, 0.8
    assert relative.walking_speed_m_s([Motion(qpos, walking)]) == pytest.approx(1.0)
