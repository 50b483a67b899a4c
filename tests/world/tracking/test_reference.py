"""Reference frames: set-points, boxes at rest, mirror images, and where episodes start."""

from dataclasses import fields, replace

import numpy as np
import torch

from tests.support.track_scenes import clips, followed, held_frames
from world import rotations
from world.character import model as character
from world.character import servos
from world.motions.clip import Clip
from world.tracking.reference import SHORTEST, reference


def test_the_set_point_of_a_frame_is_its_pose_and_what_damping_takes_of_its_speed() -> None:
    found = followed()
    free = ~found.held
    kp, kd = (torch.from_numpy(gain).float() for gain in character.gains())
    wanted = servos.coordinates(found.qpos) + kd / kp * found.qvel[:, 6:]
    low, high = (torch.from_numpy(bound).float() for bound in character.set_point_bounds())
    wanted = torch.maximum(torch.minimum(wanted, high), low)
    assert torch.allclose(found.set_point[free], wanted[free], atol=1e-6)


def test_a_held_box_moves_the_set_points_of_the_arms_alone() -> None:
    found = followed()
    kp, kd = (torch.from_numpy(gain).float() for gain in character.gains())
    low, high = (torch.from_numpy(bound).float() for bound in character.set_point_bounds())
    free = found.coordinates + kd / kp * found.qvel[:, 6:]
    free = torch.maximum(torch.minimum(free, high), low)
    moved = (found.set_point - free)[held_frames()].abs().amax(dim=0) > 1e-5
    names = [j.name for j in character.JOINTS for _ in j.range_deg]
    arms = torch.tensor(["shoulder" in name or "elbow" in name for name in names])
    assert not bool((moved & ~arms).any())
    assert bool(moved[arms].any())


def test_a_box_rests_level_and_still_where_it_is_picked_up_and_put_down() -> None:
    found = followed()
    mine = found.clip == 0
    held = torch.nonzero(mine & found.held).flatten()
    for rows, spot in (
        (torch.nonzero(mine).flatten() < held[0], found.picked[0]),
        (torch.nonzero(mine).flatten() > held[-1], found.put[0]),
    ):
        resting = torch.nonzero(mine).flatten()[rows]
        assert len(resting) > 10
        assert torch.allclose(found.box[resting, :3], spot[:3].expand(len(resting), -1))
        up = rotations.matrix(found.box[resting, 3:])[:, 2, 2]
        assert torch.allclose(up, torch.ones_like(up), atol=1e-6)
        assert float(found.box_velocity[resting].abs().max()) == 0.0


def test_frames_ahead_stop_at_the_end_of_their_clip() -> None:
    found = followed()
    last = found.stop - 1
    assert found.ahead(last, 4).tolist() == last.tolist()
    assert found.ahead(last - 2, 1).tolist() == (last - 1).tolist()
    assert found.ahead(found.first, 10).tolist() == (found.first + 10).tolist()


def test_a_mirror_image_has_the_sides_exchanged() -> None:
    found = followed()
    frames = clips()[0].frames
    own, image = found.position[:frames], found.position[frames : 2 * frames]
    sides = list(character.MIRROR_BODIES)
    assert torch.allclose(image[:, sides] * torch.tensor([1.0, -1.0, 1.0]), own, atol=1e-4)
    assert torch.equal(found.held[:frames], found.held[frames : 2 * frames])


def test_no_episode_starts_at_the_end_of_a_clip() -> None:
    weight = followed().start_weight
    for first, stop in zip(followed().first.tolist(), followed().stop.tolist(), strict=True):
        assert float(weight[stop - SHORTEST : stop].sum()) == 0.0
        assert float(weight[first:stop].sum()) > 0.0


def test_transitions_are_sampled_at_their_fraction() -> None:
    once, thrice = reference(clips()[:1]), reference(clips()[:1], 3.0)
    ratio = thrice.start_weight[once.start_weight > 0] / once.start_weight[once.start_weight > 0]
    assert set(ratio.tolist()) == {1.0, 3.0}


def test_segments_that_fail_are_started_from_and_those_before_them_of_the_same_clip() -> None:
    found = followed()
    second = int(found.segment[found.first[1]])
    failures = torch.zeros(int(found.segment[-1]) + 1)
    failures[second + 1] = 10.0
    harder = found.harder(failures)
    by_segment = [float(harder[found.segment == second + k].mean()) for k in (-1, 0, 1, 2)]
    assert by_segment[0] == 0.0
    assert by_segment[3] == 0.0
    assert abs(by_segment[1] / by_segment[2] - 0.8) < 1e-9
    assert abs(float(harder.mean()) - 1.0) < 1e-9
    assert torch.equal(found.harder(torch.zeros(3)), torch.ones_like(harder))


def test_a_clip_ends_before_its_legs_pass_through_the_box_that_it_put_down() -> None:
    """The box is inferred: here it is put where the reference walks afterwards, then where it
    walked before."""
    clip = clips()[0]
    assert clip.box is not None
    held = np.flatnonzero(clip.box.held)
    whole = reference([clip])
    assert int(whole.stop) == clip.frames

    def with_box_at(frame: int, rows: slice) -> Clip:
        assert clip.box is not None
        pose = clip.box.pose.copy()
        pose[rows, :2] = clip.root_position_m[frame, :2]
        pose[rows, 2] = 0.3  # at the height of the shins
        return replace(clip, box=replace(clip.box, pose=pose))

    last = clip.frames - 1
    cut = reference([with_box_at(last, slice(int(held[-1]) + 1, None))])
    assert held[-1] < int(cut.stop) < clip.frames
    assert not bool(cut.start_weight[int(cut.stop) - SHORTEST :].any())
    late = reference([with_box_at(0, slice(0, int(held[0]) + 1))])
    begin = int(torch.nonzero(late.start_weight)[0])
    assert 0 < begin < held[0] and int(late.stop) == clip.frames


def test_a_clip_ends_before_the_person_walks_through_a_solid_stand() -> None:
    """Where the reference walks with the box after it has taken it up, the stand is put in its way:
    its column is 0.1 m wide, from below the box to the floor."""
    clip = clips()[0]
    assert clip.box is not None
    held = np.flatnonzero(clip.box.held)
    first = int(held[0])
    assert int(reference([clip], solid=True).stop) == clip.frames
    pose = clip.box.pose.copy()
    on_the_way = (first + int(held[-1])) // 2
    pose[: first + 1, :2] = clip.root_position_m[on_the_way, :2]
    moved = replace(clip, box=replace(clip.box, pose=pose))
    assert int(reference([moved]).stop) == clip.frames
    stop = int(reference([moved], solid=True).stop)
    assert on_the_way - 20 < stop <= on_the_way
    root = clip.root_position_m[stop - 1, :2] - clip.root_position_m[on_the_way, :2]
    assert 0.05 < float(np.linalg.norm(root)) < 0.5


def test_a_reference_without_initial_states_is_else_the_same() -> None:
    every, without = (reference(clips(), starts=starts) for starts in (True, False))
    for field in fields(every):
        one, other = getattr(every, field.name), getattr(without, field.name)
        if field.name == "start_weight":
            assert bool((one > 0).any()) and not bool((other > 0).any()) and len(one) == len(other)
        else:
            assert torch.equal(one, other), field.name
