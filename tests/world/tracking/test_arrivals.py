"""Arrivals of a walker before a box, laid before the boxes of clips."""

from dataclasses import replace
from functools import cache

import torch

from tests.support.track_scenes import WORLD, bank, followed
from world import rotations
from world.tracking.arrivals import Arrivals, PickUps, seen_from
from world.tracking.reference import Reference
from world.tracking.sampler import TrackSampler


@cache
def standing() -> Reference:
    """The carrying clips, in which the person stands until 20 frames before the grip."""
    found = followed()
    qvel, position = found.qvel.clone(), found.position.clone()
    for clip in (0, 1):
        grip = grip_of(clip)
        qvel[grip - 80 : grip - 19, :2] = 0.0
        position[grip - 80 : grip - 19] = position[grip - 20]
    return replace(found, qvel=qvel, position=position)


def grip_of(clip: int) -> int:
    """The first frame of a clip in which the box is held."""
    return int(torch.nonzero(followed().held & (followed().clip == clip))[0])


def test_a_pick_up_is_where_a_person_who_stands_takes_a_box() -> None:
    """The face is the one that the person looks at: half the box's depth before its centre."""
    assert PickUps.of(followed()).grip.tolist() == [-1, -1, -1, -1], "they come without a halt"
    found = PickUps.of(standing())
    assert found.grip.tolist() == [grip_of(0), grip_of(1), -1, -1]
    stood = [grip - at for grip, at in zip(found.grip.tolist(), found.stands.tolist(), strict=True)]
    assert all(15 <= frames <= 20 for frames in stood[:2])
    picked = standing().picked[0]
    heading = standing().heading[grip_of(0)]
    assert float((found.into[0] * heading).sum()) > 0.7
    # the axis is one of the box's own
    turn = rotations.yaw(found.into[:1]) - picked[3]
    assert abs(float(turn) / (torch.pi / 2) - round(float(turn) / (torch.pi / 2))) < 1e-5
    away = (picked[:2] - found.face[0]).norm()
    assert min(abs(float(away) - 0.5 * edge) for edge in standing().size[0, :2].tolist()) < 1e-5
    assert torch.allclose((picked[:2] - found.face[0]) / away, found.into[0], atol=1e-5)


def arrival() -> Arrivals:
    """One who stands 0.4 m before a face that is in the direction (0, 1) at (2, 3), 0.1 m to the
    right of its middle, looks past it by 0.3 rad to the left, and walks on at 0.5 m/s."""
    qpos, qvel = torch.zeros(1, 43), torch.zeros(1, 34)
    qpos[0, :3] = torch.tensor((2.1, 2.6, 0.85))
    yaw = torch.tensor([torch.pi / 2 + 0.3])
    qpos[:, 3:7] = rotations.from_heading(rotations.cos_sin(yaw))
    qvel[0, :2] = torch.tensor((0.0, 0.5))
    face, into = torch.tensor([[2.0, 3.0]]), torch.tensor([[0.0, 1.0]])
    return seen_from(qpos, qvel, face, into)


def test_a_state_is_seen_from_the_face_of_the_box() -> None:
    found = arrival()
    assert torch.allclose(found.qpos[0, :3], torch.tensor((-0.4, -0.1, 0.85)), atol=1e-6)
    heading = rotations.yaw(rotations.heading(found.qpos[:, 3:7]))
    assert abs(float(heading) - 0.3) < 1e-5
    assert torch.allclose(found.qvel[0, :2], torch.tensor((0.5, 0.0)), atol=1e-6)


def test_it_is_laid_before_the_box_of_a_clip() -> None:
    ups = PickUps.of(standing())
    origin = torch.tensor([[1.0, -2.0, 0.0]])
    middle = torch.full((1, 3), 0.5)
    come = ups.laid(arrival(), torch.tensor([0]), origin, middle)
    into, face = ups.into[0], ups.face[0] + origin[0, :2]
    left = torch.stack((-into[1], into[0]))
    assert torch.allclose(come.qpos[0, :2], face - 0.4 * into - 0.1 * left, atol=1e-5)
    assert torch.allclose(come.qvel[0, :2], 0.5 * into, atol=1e-5)
    heading = rotations.heading(come.qpos[:, 3:7])[0]
    assert abs(float((heading * into).sum()) - torch.cos(torch.tensor(0.3))) < 1e-5
    spread = ups.laid(arrival(), torch.tensor([0]), origin, torch.tensor([[0.0, 1.0, 0.5]]))
    assert abs(float((spread.qpos - come.qpos)[0, :2].norm()) - 0.05) < 1e-5


def test_some_starts_shortly_before_the_grip_are_arrivals_and_no_others() -> None:
    scenes = bank().starting_in([True] * 4)
    scenes.reference = standing()
    sampler, plain = (
        TrackSampler(WORLD, one, 7) for one in (scenes.joined_from(arrival()), scenes)
    )
    ids, episodes = torch.arange(4000), torch.ones(4000, dtype=torch.int64)
    drawn, usual = sampler.draw(ids, episodes), plain.draw(ids, episodes)
    joined = (drawn.qpos[:, 7:] == 0.0).all(dim=1)
    reference = standing()
    assert bool((drawn.qpos == usual.qpos)[~joined].all())
    assert torch.equal(drawn.frame[~joined], usual.frame[~joined])
    clip = reference.clip[usual.frame]
    grip = PickUps.of(reference).grip[clip]
    before = (grip >= 0) & (usual.frame < grip) & (usual.frame >= grip - 70)
    assert not bool((joined & ~before).any())
    assert 0.5 < float(joined[before].float().mean()) < 0.7
    apart = drawn.frame - PickUps.of(reference).stands[clip]
    assert apart[joined].unique().tolist() == list(range(-25, 4))
    # the box and its mass are those that were drawn
    assert torch.equal(drawn.variant, usual.variant)
