"""Simulated states in place of the reference's: which starts have them, and where they are laid."""

import torch
from torch import Tensor

from tests.support.track_scenes import WORLD, bank, followed
from world.tracking.rollouts import Rollouts, kept, keys
from world.tracking.sampler import TrackSampler


def states(key: Tensor) -> Rollouts:
    """States that are told apart by the height of the root, their number."""
    n = len(key)
    qpos, box = torch.zeros(n, 43), torch.zeros(n, 7)
    qpos[:, 2] = torch.arange(n)
    qpos[:, 0], box[:, 1], box[:, 3] = 0.25, 0.5, 1.0
    return Rollouts(key, qpos, torch.full((n, 34), 2.0), box, torch.full((n, 6), 3.0))


def test_a_key_is_a_frame_with_one_of_the_boxes_of_its_clip() -> None:
    frame, variant = torch.tensor([0, 7, 7, 7]), torch.tensor([0, 4, 5, 7])
    assert keys(frame, variant, 3).tolist() == [0, 22, 23, 22]


def test_at_most_two_states_of_a_key_are_kept_and_by_key() -> None:
    key = torch.tensor([5, 3, 5, 5, 9, 3, 5])
    found = kept(key, torch.Generator().manual_seed(0))
    assert key[found].tolist() == [3, 3, 5, 5, 9]
    assert len(set(found.tolist())) == 5
    seen = {int(i) for seed in range(20) for i in kept(key, torch.Generator().manual_seed(seed))}
    assert seen == set(range(7)), "all have a chance"
    assert kept(torch.zeros(0, dtype=torch.int64), torch.Generator()).tolist() == []


def test_half_of_the_starts_with_a_state_have_one_of_their_own_key() -> None:
    some = states(torch.tensor([3, 3, 5]))
    key = torch.tensor([3, 4, 5, 3, 3, 9])
    u = torch.tensor([[0.1, 0.0], [0.1, 0.0], [0.1, 0.9], [0.6, 0.0], [0.4, 0.9], [0.0, 0.9]])
    rows, number = some.replaced(key, u)
    assert rows.tolist() == [0, 2, 4] and number.tolist() == [0, 2, 1]
    none = states(torch.zeros(0, dtype=torch.int64))
    assert none.replaced(key, u)[0].tolist() == []


def test_a_start_is_laid_where_its_clip_is_and_all_others_stay() -> None:
    frames = torch.arange(len(followed().clip))
    key = torch.unique(
        torch.cat([keys(frames, torch.full_like(frames, box), bank().each) for box in range(2)])
    )
    scenes = bank().joined_from(None, states(key))
    ids, episodes = torch.arange(2000), torch.ones(2000, dtype=torch.int64)
    found = TrackSampler(WORLD, scenes, 7).draw(ids, episodes)
    plain = TrackSampler(WORLD, bank().joined_from(None, None), 7)
    usual = plain.draw(ids, episodes)
    # of 12 and of 2 random numbers the first two are the same
    assert torch.equal(found.frame, usual.frame) and torch.equal(found.variant, usual.variant)
    new = (found.qvel == 2.0).all(dim=1)
    assert 0.45 < float(new.float().mean()) < 0.55
    for name in ("qpos", "qvel", "box", "box_velocity"):
        assert torch.equal(getattr(found, name)[~new], getattr(usual, name)[~new]), name
    assert torch.allclose(found.qpos[new, 0], found.origin[new, 0] + 0.25)
    wanted = keys(found.frame, found.variant, bank().each)[new]
    assert torch.equal(key[found.qpos[new, 2].long()], wanted)
    boxed = followed().boxed[followed().clip[found.frame]] & new
    assert torch.allclose(found.box[boxed, 1], found.origin[boxed, 1] + 0.5)
    assert bool((found.box_velocity[boxed] == 3.0).all())
    # a clip without a box has it out of the scene, at rest
    without = new & ~boxed
    assert bool(without.any()) and torch.equal(found.box[without], usual.box[without])
    target = TrackSampler(WORLD, scenes, 7).target(found)
    assert target.box is not None and torch.equal(target.box.position, found.box[:, :3])
