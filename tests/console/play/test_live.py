"""A live scene: pushes, branches, blow-ups, style."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from console.kinds.setup import Pose
from console.play import saving
from console.play.browser import plots
from console.play.live import Live
from console.play.player import Player
from console.play.scene import STEP_S
from console.play.session import Session
from console.play.source import heading
from tests.support.console.players import POLICIES, live, qpos, stock
from world.character import model as character
from world.errors import ConfigError, InhabitError


def momentum(source: Live) -> NDArray[np.float64]:
    """Of the character, kg m/s, [3]."""
    physics = {name: value[0].numpy() for name, value in source.moments[-1].physics.items()}
    data = mujoco.MjData(source.model)
    data.qpos[:], data.qvel[:] = physics["qpos"], physics["qvel"]
    mujoco.mj_forward(source.model, data)
    mujoco.mj_subtreeVel(source.model, data)
    pelvis = source.model.body(character.BODIES[0]).id
    return source.model.body_subtreemass[pelvis] * data.subtree_linvel[pelvis]


def floating(source: Live) -> Live:
    """Five metres above the floor, where nothing but gravity pushes."""
    moment = source.moments[0]
    raised = moment.physics["qpos"].clone()
    raised[0, 2] += 5.0
    source.moments[0] = replace(moment, physics=moment.physics | {"qpos": raised})
    source.cut(0)
    return source


def test_a_push_changes_the_momentum_by_its_impulse() -> None:
    ends = []
    for impulse in (0.0, 60.0):
        source = floating(live("limp", start=Pose(0.0, 0.0, math.pi / 2)))
        session = Session(source)
        # a quarter turn to its left, when it looks along +y, is -x
        session.push(impulse, math.pi / 2, "torso")
        assert source.extend()
        ends.append(momentum(source))
        assert source.extend()
        ends.append(momentum(source))
    np.testing.assert_allclose(ends[2] - ends[0], [-60.0, 0.0, 0.0], atol=0.6)
    # one push acts once
    np.testing.assert_allclose(ends[3] - ends[1], [-60.0, 0.0, 0.0], atol=1.2)
    with pytest.raises(InhabitError, match="unknown body 'tail': choose one of head"):
        source.scene.push(np.zeros(3), "tail")


def test_no_push_is_harder_than_the_hardest() -> None:
    source = floating(live("limp"))
    source.scene.push(np.array([0.0, 1e6, 0.0]), "pelvis")
    assert source.extend()
    assert momentum(source)[1] == pytest.approx(200.0, rel=0.01)


def test_going_on_from_a_past_frame_repeats_it_bit_for_bit() -> None:
    source = live()
    player = Player(source)
    for _ in range(10):
        player.advance(4 * STEP_S)
    assert player.frame == player.last == 40
    first = [qpos(source, frame).copy() for frame in range(41)]
    player.seek(15)
    assert (player.frame, player.playing) == (15, False)
    assert player.advance(10.0) == 0, "a pause lasts"
    player.branch()
    assert len(source) == 16 and player.playing
    while player.last < 40:
        player.advance(STEP_S)
    for frame in range(41):
        np.testing.assert_array_equal(qpos(source, frame), first[frame])
    player.seek(15)
    player.branch()
    source.scene.push(np.array([60.0, 0.0, 0.0]), "torso")
    for _ in range(10):
        source.extend()
    assert np.abs(qpos(source, 25) - first[25]).max() > 0.05


def test_the_past_cannot_be_pushed() -> None:
    session = Session(live())
    session.player.advance(0.2)
    session.player.seek(2)
    for act in (session.throw, lambda: session.push(1.0, 0.0, "head")):
        with pytest.raises(ConfigError, match="this moment is past"):
            act()


@pytest.mark.parametrize("task", ["sit", "lie", "carry"])
def test_every_task_plays(task: str) -> None:
    source = live(task, start=Pose(0.5, -1.0, 0.3), goal=Pose(3.0, 1.0, -2.0))
    for _ in range(10):
        assert source.extend()
    start = qpos(source, 0)
    assert (start[0], start[1], heading(start)) == pytest.approx((0.5, -1.0, 0.3))
    curves = source.curves()
    assert set(curves.terms) == set(POLICIES[task].task.terms) and "no style" in curves.missing
    assert all(len(values) == 11 for values in curves.terms.values())
    assert curves.error_m is not None
    place = source.scene._object.target(source.scene._scenes)
    assert place.point[0, :2].tolist() == pytest.approx([3.0, 1.0])


def test_a_scene_that_blows_up_stops_and_can_be_gone_back_in() -> None:
    source = live()
    for _ in range(5):
        source.extend()
    broken = {k: v.clone() for k, v in source.moments[-1].physics.items()}
    broken["qvel"][:] = 1e9
    source.scene._scenes.load_physics(broken)
    assert not source.extend() and "blew up" in source.ended and len(source) == 6
    assert not source.extend()
    player = Player(source)
    player.seek(3)
    player.branch()
    assert source.extend() and not source.ended and len(source) == 5


def test_style_is_that_of_each_step() -> None:
    judged: list[tuple[torch.Tensor, torch.Tensor]] = []

    def judge(before: torch.Tensor, after: torch.Tensor) -> torch.Tensor:
        judged.append((before, after))
        return torch.full((1,), 0.25 * len(judged))

    found = stock(sit=replace(POLICIES["sit"], style=judge))
    source = found.begin(found.first())
    for _ in range(3):
        source.extend()
    style = source.curves().style
    assert style is not None and np.isnan(style[0]) and style[1:].tolist() == [0.25, 0.5, 0.75]
    lines = plots.series_of(source.curves(), {})["style reward"]
    seconds, values = plots.points(lines, plots.window(3))
    assert seconds.tolist() == pytest.approx([1 / 30, 2 / 30, 3 / 30])
    assert values.tolist() == [0.25, 0.5, 0.75], "the start ends no step: it has no style"
    for step, (before, after) in enumerate(judged):
        torch.testing.assert_close(before[0], source.moments[step].state)
        torch.testing.assert_close(after[0], source.moments[step + 1].state)
    assert "style 0.75" in source.status(3) and source.curves().missing == ""
    assert b'"style":[0.25,0.5,0.75]' in saving.html(Player(source), "t")
