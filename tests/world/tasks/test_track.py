"""The track task: rewards, ends and the goal by hand at states of a clip."""

import math
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from tests.support.track_scenes import at, body, clips, followed, held_frames
from world import rotations
from world.character import servos
from world.character.features import Body
from world.tasks import make, state
from world.tasks.symmetry import symmetry
from world.tasks.track import AHEAD, GRIP_STEPS, Track, joint_coordinates
from world.tracking.target import TrackTarget, gap_m

TASK = Track()
NAMES = list(Track.terms)


def moved(found: Body, by: tuple[float, float, float]) -> Body:
    return replace(found, position=found.position + torch.tensor(by))


def terms(found: Body, target: TrackTarget) -> dict[str, Tensor]:
    return dict(zip(NAMES, TASK.reward_terms(found, target).unbind(1), strict=True))


def ends(found: Body, target: TrackTarget) -> list[str]:
    stage = TASK.stage(found, target)[0]
    return [name for name, hit in zip(Track.stages, stage.tolist(), strict=True) if hit]


def carried(count: int = 1) -> Tensor:
    """Frames in the middle of the carrying."""
    held = held_frames()
    return held[len(held) // 2 : len(held) // 2 + count]


def test_weights_add_up_and_a_perfect_reference_earns_one() -> None:
    assert sum(Track.terms.values()) == pytest.approx(1.0)
    every = torch.arange(len(followed().clip))
    found, target = at(every)
    earned = terms(found, target)
    for name in ("body", "joint", "velocity", "root", "box", "box_angle"):
        # the angle between equal quaternions is known to single precision
        assert float(earned[name].min()) > 0.999, name
    assert target.box is not None
    touches = (gap_m(found, target.box) < 0.02).all(dim=1)
    whole = ~target.boxed() | ~target.holds() | touches
    assert float(earned["contact"][whole].min()) > 0.95
    assert int((whole & target.holds()).sum()) > 30
    reward = TASK.reward_terms(found, target) @ torch.tensor(list(Track.terms.values()))
    assert float(reward[whole].min()) > 0.99


def test_rewards_of_a_character_that_drifts_with_and_without_the_box_in_hand() -> None:
    lost = math.exp(-15 * 0.01)
    for frame, along in ((carried(), 1.0), (torch.tensor([5]), lost)):
        found, target = at(frame)
        drifted = terms(moved(found, (0.1, 0.0, 0.0)), target)
        assert float(drifted["body"]) == pytest.approx(1.0, abs=1e-4)
        # half exp(-0.04) and half exp(-0.3)
        assert float(drifted["root"]) == pytest.approx(0.5 * 0.960789 + 0.5 * 0.740818, 1e-4)
        # where it is in the world is right in either case; along with the root while it is held
        assert float(drifted["box"]) == pytest.approx(1.0, abs=1e-4)
        assert target.box is not None
        there = target.box.position + torch.tensor([0.1, 0.0, 0.0])
        both = replace(target, box=replace(target.box, position=there))
        assert float(terms(moved(found, (0.1, 0.0, 0.0)), both)["box"]) == pytest.approx(
            along, abs=1e-4
        )
        assert float(terms(found, both)["box"]) == pytest.approx(lost, abs=1e-4)


def test_rewards_of_other_poses_by_hand() -> None:
    found, target = at(carried())
    off = found.position.clone()
    off[:, 1:, 2] += 0.1
    assert float(terms(replace(found, position=off), target)["body"]) == pytest.approx(
        torch.exp(torch.tensor(-0.15)).item(), abs=1e-4
    )
    faster = replace(found, root_velocity=found.root_velocity + torch.tensor([0.5, 0.0, 0.0]))
    assert float(terms(faster, target)["velocity"]) == pytest.approx(
        torch.exp(torch.tensor(-0.25)).item(), abs=1e-4
    )
    assert target.box is not None
    turn = torch.tensor([[0.9689124, 0.0, 0.0, 0.2474040]])  # 0.5 rad about z
    turned = replace(target.box, rotation=rotations.multiply(turn, target.box.rotation))
    assert float(terms(found, replace(target, box=turned))["box_angle"]) == pytest.approx(
        torch.exp(torch.tensor(-0.5)).item(), abs=1e-3
    )
    away = replace(target.box, position=target.box.position + torch.tensor([0.0, 0.0, 2.0]))
    assert float(terms(found, replace(target, box=away))["contact"]) == pytest.approx(0.0, abs=1e-6)


def test_episodes_end_by_the_kind_of_deviation() -> None:
    found, target = at(carried())
    assert ends(found, target) == []
    assert ends(moved(found, (0.69, 0.0, 0.0)), target) == []
    free, far = at(torch.tensor([5]))
    assert ends(moved(free, (0.69, 0.0, 0.0)), far) == []
    assert ends(moved(free, (0.71, 0.0, 0.0)), far) == ["end_root"]
    assert ends(moved(free, (0.0, 0.0, -0.31)), far) == ["end_root"]
    folded = free.position.clone()
    folded[:, 1:, 0] += 0.29
    assert ends(replace(free, position=folded), far) == []
    folded[:, 1:, 0] += 0.02
    assert ends(replace(free, position=folded), far) == ["end_body"]
    assert TASK.fell(replace(free, position=folded), far).tolist() == [True]
    assert target.box is not None
    dropped = replace(target.box, position=target.box.position - torch.tensor([0.0, 0.0, 0.31]))
    assert ends(found, replace(target, box=dropped)) == ["end_box"]


def test_a_grip_is_lost_after_ten_control_steps_in_a_row() -> None:
    found, target = at(carried())
    assert target.box is not None
    sideways = replace(target.box, position=target.box.position + torch.tensor([0.0, 0.0, 0.29]))
    lost = replace(target, box=sideways)
    for step in range(GRIP_STEPS):
        assert ends(found, lost) == [], step
        lost.advance(found)
    assert ends(found, lost) == ["end_grip"]
    # the same grip found again counts from the start
    kept = replace(target, box=target.box, frame=target.frame - 1)
    touching = body(kept.frame + 1, kept)
    assert target.box is not None
    kept.advance(touching)
    assert kept.lost.tolist() == [0] or bool((gap_m(touching, target.box) > 0.02).any())


def test_the_clips_end_is_over_and_no_failure() -> None:
    last = followed().stop[:1] - 1
    target = at(last - 1)[1]
    assert target.completed().tolist() == [False]
    target.advance(body(last, target))
    assert target.completed().tolist() == [True]
    assert TASK.fell(body(last, target), target).tolist() == [False]


def test_the_goal_shows_the_reference_ahead_in_the_heading_frame() -> None:
    frame = carried()
    found, target = at(frame)
    goal = TASK.goal_features(found, target)
    assert goal.shape == (1, TASK.goal.width)
    table, reference = TASK.goal, followed()

    def part(name: str) -> Tensor:
        return goal[0, table.slice(name)]

    for k in AHEAD:
        way = reference.position[frame + k, 0] - reference.position[frame, 0]
        assert torch.allclose(
            part(f"root_in_{k}"), rotations.turn_back(found.heading, way)[0], atol=1e-5
        )
        held = reference.box[frame + k, :3] - reference.position[frame + k, 0]
        assert torch.allclose(
            part(f"box_in_{k}"), rotations.turn_back(found.heading, held)[0], atol=1e-5
        )
        assert part(f"right_grip_in_{k}").tolist() == [1.0]
    error = reference.set_point[frame + 1] - reference.coordinates[frame]
    assert torch.allclose(part("setpoint_error"), error[0], atol=1e-4)
    assert target.box is not None
    half = [float(part(f"box_half_{axis}")) for axis in "xyz"]
    assert half == pytest.approx(target.box.half[0].tolist())
    assert float(part("box_mass")) == pytest.approx(float(target.mass[0]))


def test_a_clip_without_a_box_shows_none_and_sees_its_seat() -> None:
    frame = followed().first[2:3] + 40
    found, target = at(frame)
    goal = TASK.goal_features(found, target)[0]
    for name in ("box_in_1", "box_axes_in_4", "right_reach", "box_mass", "left_grip_in_10"):
        assert float(goal[TASK.goal.slice(name)].abs().max()) == 0.0, name
    seat = clips()[2].seat
    assert seat is not None
    there = torch.tensor([[*seat.point_m[:2], 0.0]]) + target.origin - found.root
    seen = state(found, target)[0, -9:-6]
    assert torch.allclose(seen, rotations.turn_back(found.heading, there)[0], atol=1e-5)


def test_joints_are_read_off_the_features_as_the_servos_measure_them() -> None:
    every = torch.arange(0, len(followed().clip), 7)
    found, _ = at(every)
    wanted = servos.coordinates(followed().qpos[every])
    assert torch.allclose(joint_coordinates(found), wanted, atol=2e-3)


def test_the_mirror_image_of_a_scene_is_the_scene_of_the_mirror_image() -> None:
    frames = torch.arange(10, clips()[0].frames - 10, 25)
    reflect = symmetry(make("track")).observation
    observed = []
    for rows in (frames, frames + clips()[0].frames):
        found, target = at(rows)
        observed.append(torch.cat((state(found, target), TASK.goal_features(found, target)), 1))
    own, image = observed
    # every box has a weight of its own
    mass = 114 + TASK.goal.slice("box_mass").start
    image[:, mass] = own[:, mass]
    assert torch.allclose(reflect(own), image, atol=5e-3)
