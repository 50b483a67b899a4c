"""The player without a browser: time, pushes, furniture that moves, what is kept and what fails."""

import base64
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from console.kinds.setup import Pose, Setup
from console.play import recorded, saving
from console.play.browser import plots
from console.play.browser.drawing import mesh_of
from console.play.browser.ghost import Ghost, placed
from console.play.live import Live
from console.play.player import Player
from console.play.scene import STEP_S, Scene
from console.play.session import Session
from console.play.source import Curves, heading
from console.play.stock import Stock
from console.recording import format as recording
from console.recording.format import Recording
from tests.console.recording.test_format import take
from tests.support import policy_cases, small_clips
from world.character import model as character
from world.errors import ConfigError, InhabitError
from world.furniture.usage import spots
from world.motions import load
from world.realism.measures import Motion
from world.tasks.sit import HIP_ABOVE_SEAT_M

POLICIES = {task: policy_cases.make(1, task, task) for task in ("sit", "lie", "carry")}


#: Does nothing: what moves it is something else.
LIMP = replace(
    POLICIES["sit"], weights={k: 0 * v if "actor" in k else v for k, v in
                              POLICIES["sit"].weights.items()}
)  # fmt: skip


def stock(**policies: object) -> Stock:
    return Stock({**POLICIES, **policies})  # pyright: ignore


def live(task: str = "sit", **changes: object) -> Live:
    found = stock(limp=LIMP)
    piece = next(iter(found.pieces(task)))
    return found.begin(replace(Setup(task, piece), **changes))  # pyright: ignore


def qpos(source: Live, frame: int) -> NDArray[np.float64]:
    return source.moments[frame].physics["qpos"][0].numpy()


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


def test_furniture_glides_and_takes_the_goal_along() -> None:
    source = live()
    seat = source.scene.piece.sit[0].point_m[2] + HIP_ABOVE_SEAT_M

    def error(moment_goal: Pose) -> float:
        root = qpos(source, len(source) - 1)[:3]
        return float(np.linalg.norm(root - [moment_goal.x, moment_goal.y, seat]))

    first = source.moments[0].physics["mocap_pos"][0].numpy().reshape(-1, 3)[0].copy()
    Session(source).move(Pose(2.5, 4.0, math.pi))
    for _ in range(20):
        assert source.extend()
    goal = source.moments[-1].goal
    assert (goal.x, goal.y) == pytest.approx((2.5, 1.5 * 20 * STEP_S))
    moved = source.moments[-1].physics["mocap_pos"][0].numpy().reshape(-1, 3)[0]
    np.testing.assert_allclose(moved - first, [0.0, 1.0, 0.0], atol=1e-6)
    assert source.moments[-1].error_m == pytest.approx(error(goal), abs=1e-4)
    for _ in range(80):
        assert source.extend()
    assert (source.scene.goal.x, source.scene.goal.y) == pytest.approx((2.5, 4.0))
    with pytest.raises(ConfigError, match="within 20 m"):
        source.scene.move(Pose(99.0, 0.0))


def test_a_goal_turns_the_shorter_way() -> None:
    turned = Pose(0, 0, 3.0).stepped(Pose(3, 4, -3.0), 2.5, 0.1)
    assert (turned.x, turned.y, turned.yaw) == pytest.approx((1.5, 2.0, 3.1))


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


class Counted:
    """A source of so many frames."""

    def __init__(self, frames: int) -> None:
        self.frames = frames

    def __len__(self) -> int:
        return self.frames

    def extend(self) -> bool:
        return False

    def curves(self) -> Curves:
        return Curves()


def test_time_passes_as_it_is_told_to() -> None:
    player = Player(Counted(100))  # pyright: ignore
    assert [player.advance(1 / 60) for _ in range(6)] == [0, 1, 0, 1, 0, 1]
    player.run(2.0)
    assert player.advance(0.1 + 1e-9) == 6 and player.frame == 9
    player.run(0.1)
    assert sum(player.advance(0.1) for _ in range(40)) == pytest.approx(12, abs=1)
    player.run(4.0)
    assert player.advance(5.0) == 8, "a slow machine gives up time, not frames"
    for wrong in (0.0, 9.0, math.nan):
        with pytest.raises(ConfigError, match=r"choose 0\.1 to 4"):
            player.run(wrong)
    player.seek(500)
    assert player.frame == 99
    player.play(True)
    assert player.frame == 0 and player.playing, "from the beginning"
    player.seek(98)
    player.play(True)
    assert player.advance(1.0) == 1 and not player.playing


def test_balls_fly_and_are_taken_away() -> None:
    source = live()
    assert np.isnan(source.moments[0].balls).all()
    Session(source).throw()
    for _ in range(75):
        assert source.extend()
    there = [np.isfinite(m.balls).all(axis=1).tolist() for m in source.moments]
    assert there[1] == [True, False, False, False] and not any(there[-1])
    flown = source.moments[2].balls[0] - source.moments[1].balls[0]
    # 10 m/s at the target, plus the character's own velocity and the fall
    assert 9.0 < np.linalg.norm(flown) / STEP_S < 13.0
    pelvis = source.model.body("projectile0").id
    assert np.isfinite(source.poses(1)[pelvis]).all() and np.isnan(source.poses(70)[pelvis, 0])


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


def test_a_bed_has_a_side_of_its_own_choice() -> None:
    both = [n for n, p in stock().pieces("lie").items() if len(spots(p, "lie")) == 2]
    beds = [n for n in both if n.startswith("bed")]  # single ones: a double bed has one side
    found = []
    for side in (0, 1):
        source = stock().begin(Setup("lie", beds[0], side=side, goal=Pose(3.0, 0.0, 0.5)))
        place = source.scene._object.target(source.scene._scenes)
        assert place.facing[0].tolist() == pytest.approx([math.cos(0.5), math.sin(0.5)])
        # the head is to the left of one side and to the right of the other
        assert place.head is not None
        along = (place.head - place.point)[0, :2].numpy()
        found.append(np.cross([*place.facing[0].numpy(), 0.0], [*along, 0.0])[2])
    assert found[0] * found[1] < 0
    with pytest.raises(ConfigError, match="has sides 0 to 1"):
        stock().begin(Setup("lie", beds[0], side=2))


def test_a_box_stands_where_it_should_and_its_goal_moves() -> None:
    source = live("carry", box=Pose(1.0, 0.5))
    assert qpos(source, 0)[43:45] == pytest.approx([1.0, 0.5])
    source.scene.move(Pose(2.5, 0.5))
    for _ in range(15):
        assert source.extend()
    stands = source.moments[-1].physics["mocap_pos"][0].numpy().reshape(-1, 3)
    assert stands[0, :2] == pytest.approx([1.0, 0.5]) and stands[1, :2] == pytest.approx([2.5, 0.5])
    box = qpos(source, 15)[43:46]
    goal = [2.5, 0.5, stands[1, 2] + source.scene.piece.boxes[0].half_m[2]]
    assert source.moments[-1].error_m == pytest.approx(float(np.linalg.norm(box - goal)), abs=1e-4)


def test_what_makes_no_scene_is_one_line() -> None:
    chair = next(iter(stock().pieces("sit")))
    for setup, said in (
        (Setup("fly", chair), "unknown policy 'fly': choose one of carry, lie, sit"),
        (Setup("sit", "throne"), "unknown piece 'throne': choose one of"),
        (Setup("sit", chair, scale=9.0), "scale 9: choose 0.5 to 1.5"),
        (Setup("sit", chair, goal=Pose(math.nan, 0)), "goal: must be finite numbers"),
        (Setup("sit", chair, start=Pose(0, 50)), "start: choose x and y within 20 m"),
    ):
        with pytest.raises(InhabitError, match=re.escape(said)) as error:
            Session(live(), stock()).begin(setup)
        assert "\n" not in str(error.value)


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


@pytest.mark.parametrize("task", ["sit", "carry"])
def test_what_is_saved_plays_again(task: str, tmp_path: Path) -> None:
    source = live(task)
    source.scene.throw()
    for _ in range(12):
        source.extend()
    path = tmp_path / "kept.msgpack"
    path.write_bytes(saving.msgpack(Player(source)))
    ((name, again),) = recorded.read(path).items()
    assert source.scene.piece.name in name and len(again) == 13
    body = [source.model.body(n).id for n in (*character.BODIES, "furniture")]
    ball = source.model.body("projectile0").id
    for frame in (0, 5, 12):
        ours, theirs = source.poses(frame), again.poses(frame)
        np.testing.assert_allclose(theirs[body], ours[body], atol=1e-9)
        np.testing.assert_allclose(theirs[ball, :3], ours[ball, :3])
    was, now = source.curves(), again.curves()
    assert list(was.terms) == list(now.terms) and was.error_m is not None
    for term in was.terms:
        np.testing.assert_allclose(now.terms[term], was.terms[term], atol=1e-4)
    np.testing.assert_allclose(now.error_m, was.error_m, atol=1e-4)
    with pytest.raises(ConfigError, match="cannot go on"):
        again.cut(3)
    with pytest.raises(ConfigError, match="cannot be touched"):
        Session(again).throw()


def test_an_exported_page_needs_nothing_else() -> None:
    source = live()
    for _ in range(30):
        source.extend()
    text = saving.html(Player(source), "inhabit </script> play").decode()
    assert not re.findall(r"(?:src|href)=|https?:|url\(|import ", text)
    assert text.count("</script>") == 2, "the data's and the viewer's"
    (data,) = json.loads(text.split('id="takes">')[1].split("</script>")[0])
    poses = np.frombuffer(base64.b64decode(data["poses"]), "<i2").reshape(31, -1, 7)
    root = poses[:, data["root"], :3] / 1000.0
    np.testing.assert_allclose(root, [qpos(source, i)[:3] for i in range(31)], atol=6e-4)
    assert data["error"][30] == pytest.approx(source.moments[30].error_m, abs=1e-3)
    assert "no discriminator" in text and "reward terms" in text


def test_clips_and_recordings_without_a_goal_play_without_curves(tmp_path: Path) -> None:
    folder = small_clips.write(tmp_path)
    file = sorted(folder.glob("*.npz"))[0]
    found = recorded.read(file)
    clip = load.read(file)
    source = next(iter(found.values()))
    assert "no goal" in source.curves().missing and source.status(0) == ""
    np.testing.assert_allclose(source.state(0)[0][7:], clip.qpos()[0][7:], atol=1e-3)
    with pytest.raises(ConfigError, match="only what has a goal can be exported"):
        saving.html(Player(source), "t")
    stray = tmp_path / "stray.msgpack"
    recording.write(stray, Recording([replace(take(), piece="stool-mine-1")], {"task": "sit"}))
    (other,) = recorded.read(stray).values()
    assert "no reward terms: unknown split 'mine'" in other.curves().missing
    assert np.isfinite(other.poses(0)).all()


def test_the_nearest_mocap_of_a_clip_is_itself(tmp_path: Path) -> None:
    library = load.library([str(small_clips.write(tmp_path))], mirror=False)
    ghost = Ghost(library)
    at = 40
    match = ghost.nearest(Motion(library.qpos[at : at + 2], library.qvel[at : at + 2]))
    assert match.distance < 1e-3 and match.clip == library.clips[0].name
    np.testing.assert_allclose(match.qpos, library.qpos[at + 1].double(), atol=1e-5)
    where = character.standing_qpos()
    where[:2], where[3:7] = (3.0, -2.0), (math.cos(0.4), 0.0, 0.0, math.sin(0.4))
    moved = placed(match.qpos, where)
    assert (*moved[:2], heading(moved)) == pytest.approx((3.0, -2.0, 0.8))
    assert moved[2] == match.qpos[2]
    np.testing.assert_array_equal(moved[7:], match.qpos[7:])


def test_shapes_are_drawn_at_their_size() -> None:
    upright = {"pos": [1.0, 2.0, 3.0], "quat": [1.0, 0.0, 0.0, 0.0]}
    capsule = mesh_of({"kind": "capsule", "size": [0.1, 0.3, 0.0], **upright})
    np.testing.assert_allclose(capsule.bounds, [[0.9, 1.9, 2.6], [1.1, 2.1, 3.4]], atol=2e-3)
    assert capsule.volume == pytest.approx(math.pi * (0.01 * 0.6 + 4 / 3 * 0.001), rel=0.08)
    half = math.sqrt(0.5)
    turned = {"pos": [0.0, 0.0, 0.0], "quat": [half, 0.0, 0.0, half]}
    box = mesh_of({"kind": "box", "size": [0.1, 0.2, 0.3], **turned})
    np.testing.assert_allclose(box.bounds[1], [0.2, 0.1, 0.3], atol=1e-9)


def test_a_scene_belongs_to_its_setup() -> None:
    served = POLICIES["sit"]
    piece = stock().piece("sit", next(iter(stock().pieces("sit"))), 1.2)
    scene = Scene(served, piece, Setup("sit", piece.name, 1.2))
    assert scene.model.geom("slot0").size == pytest.approx(np.array(piece.boxes[0].half_m))
