"""Initial states of following clips: anywhere, deterministic, harder segments more often."""

from dataclasses import replace

import pytest
import torch

from tests.support.track_scenes import WORLD, bank, clips, followed, motions
from world import rotations
from world.config import TrackConfig
from world.episodes.cloning import pairs
from world.errors import ConfigError
from world.tasks.track import Track
from world.tracking.bank import TrackBank
from world.tracking.sampler import TrackSampler


def test_a_start_is_a_function_of_seed_scene_and_episode() -> None:
    sampler = TrackSampler(WORLD, bank(), 7)
    scenes = torch.arange(64)
    every = sampler.draw(scenes, torch.full((64,), 3))
    one = TrackSampler(WORLD, bank(), 7).draw(scenes[40:41], torch.tensor([3]))
    for name in ("qpos", "qvel", "variant", "frame", "origin"):
        assert torch.equal(getattr(every, name)[40:41], getattr(one, name)), name
    other = TrackSampler(WORLD, bank(), 8).draw(scenes, torch.full((64,), 3))
    assert int((other.frame != every.frame).sum()) > 50


def test_starts_are_anywhere_in_every_clip_with_its_own_things() -> None:
    sampler = TrackSampler(WORLD, bank(), 0)
    states = sampler.draw(torch.arange(4000), torch.ones(4000, dtype=torch.int64))
    reference = followed()
    weight = reference.start_weight
    for clip in range(4):
        mine = reference.clip[states.frame] == clip
        share = float(weight[reference.clip == clip].sum() / weight.sum())
        assert float(mine.float().mean()) == pytest.approx(share, abs=0.03)
        assert set(states.variant[mine].tolist()) == {2 * clip, 2 * clip + 1}
    target = sampler.target(states)
    assert target.box is not None
    assert float(states.qpos[:, :2].abs().max()) == 0.0
    boxed = reference.boxed[reference.clip[states.frame]]
    there = reference.box[states.frame, :3] - reference.qpos[states.frame, :3]
    own = target.box.position - states.qpos[:, :3]
    assert torch.allclose(own[boxed], there[boxed], atol=5e-3)
    assert float(target.box.position[~boxed, 0].max()) == -50.0
    again = bank().half[states.variant] / (0.5 * reference.size[reference.clip[states.frame]])
    assert 1.0 <= float(again[boxed].min()) <= float(again[boxed].max()) <= 1.15


def test_failures_draw_half_of_the_starts_to_where_they_happened() -> None:
    sampler = TrackSampler(WORLD, bank(), 0)
    reference = followed()
    segment = int(reference.segment[held := int(torch.nonzero(reference.held)[60])])
    assert reference.start_weight[held] > 0
    failures = torch.zeros(segment + 1)
    failures[segment] = 100.0
    scenes, episode = torch.arange(4000), torch.ones(4000, dtype=torch.int64)

    def share() -> float:
        near = (segment - reference.segment[sampler.draw(scenes, episode).frame]).float()
        return float(((near >= 0) & (near <= 2)).float().mean())

    before = share()
    sampler.update_sampling({"failures": failures})
    assert before < 0.1
    assert 0.4 < share() < 0.65
    sampler.update_sampling({"failures": torch.zeros(segment + 1)})
    assert share() == before


@pytest.mark.parametrize(
    "wrong",
    [{"size": (1.2, 1.0)}, {"weight_kg": (0.0, 1.0)}, {"friction": (-1.0, 1.0)}, {"boxes": 0}],
)
def test_settings_that_make_no_box_are_refused(wrong: dict[str, tuple[float, float]]) -> None:
    with pytest.raises(ConfigError, match=r"track\."):
        TrackBank(clips()[:1], followed(), replace(TrackConfig(), **wrong))


def test_to_clone_the_clips_is_to_add_nothing_to_their_set_points() -> None:
    observations, actions = pairs(WORLD, motions(), bank(), 50, 0)
    assert observations.shape == (50, 114 + Track.goal.width)
    assert not bool(actions.any())


def test_a_share_beyond_one_is_refused() -> None:
    with pytest.raises(ConfigError, match="focus"):
        TrackSampler(replace(WORLD, track=replace(WORLD.track, focus=1.5)), bank(), 0)


def test_displaced_starts_are_beside_the_reference_where_the_hands_are_free() -> None:
    """Mostly away from the box, turned a little, with the velocity turned along; the reference and
    its box stay where they are."""
    config = replace(WORLD, track=replace(WORLD.track, displaced_m=0.4))
    scenes, episodes = torch.arange(3000), torch.ones(3000, dtype=torch.int64)
    sampler = TrackSampler(config, bank(), 7)
    moved = sampler.draw(scenes, episodes)
    there = sampler.at(moved.frame, torch.zeros(3000))
    reference = followed()
    step = moved.qpos[:, :2] - there.qpos[:, :2]
    far = step.norm(dim=1)
    held = reference.held[moved.frame]
    boxed = reference.boxed[reference.clip[moved.frame]]
    assert not bool(far[held].any()) and not bool(far[~boxed].any())
    free = far > 0
    assert 0.3 < float(free[boxed & ~held].float().mean()) <= 1.0
    assert 0.39 < float(far.max()) <= 0.4 and 0.2 < float(far[free].mean()) < 0.32
    to_box = reference.box[moved.frame, :2] - reference.position[moved.frame, 0, :2]
    towards = (step * to_box / to_box.norm(dim=1, keepdim=True)).sum(dim=1)[free] / far[free]
    assert float(towards.max()) < 0.23  # within 1.8 rad of straight away from it
    before, after = (rotations.heading(s.qpos[:, 3:7]) for s in (there, moved))
    angle = torch.acos((before * after).sum(dim=1).clamp(-1.0, 1.0))
    assert bool((angle <= far + 2e-3).all()) and float(angle.max()) > 0.2
    # as the character itself sees it, its speed is the same
    speed = rotations.turn_back(after, moved.qvel[:, :2])
    torch.testing.assert_close(
        speed, rotations.turn_back(before, there.qvel[:, :2]), atol=2e-3, rtol=0
    )
    assert torch.equal(moved.origin, there.origin)
    target = sampler.target(moved)
    assert target.box is not None
    assert torch.equal(target.box.position, sampler.target(there).box.position)  # type: ignore[union-attr]
