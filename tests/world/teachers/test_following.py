"""A tracker that is watched: what counts as going on, and states that physics goes on from."""

from dataclasses import replace

import torch
from torch import Tensor

from tests.support.track_scenes import WORLD, bank, followed, motions
from world.episodes.shard import Shard
from world.scene.batch import Scenes
from world.teachers.following import WatchedTracker, went_on
from world.tracking.sampler import TrackSampler


def test_an_episode_goes_on_for_a_second_or_to_the_end_of_its_clip() -> None:
    """Three scenes over 40 steps: one goes on, one fails at step 20, one ends its clip there."""
    episode = torch.ones(40, 3, dtype=torch.int64)
    episode[20:, 1:] = 2
    ends = torch.zeros(40, 3, dtype=torch.bool)
    ends[19, 2] = True
    good = went_on(episode, ends)
    assert good[:10, 0].all() and not good[10:, 0].any(), "the watch is over 30 steps later"
    assert not good[:, 1].any()
    assert good[:20, 2].all() and not good[20:, 2].any()
    # the clip's last frame came, but the episode is still the same: it has not ended
    ends[:] = False
    ends[39, 0] = True
    assert not went_on(episode, ends)[10:, 0].any()


def nothing(state: Tensor, goal: Tensor) -> Tensor:
    return torch.zeros(len(state), 28)


def test_physics_goes_on_from_what_was_kept() -> None:
    watch = WatchedTracker(nothing, 32, bank().each)
    shard = Shard(WORLD, motions(), bank(), range(32), 3, watch)
    for _ in range(90):
        action = shard.label()
        assert action is not None
        shard.step(action)
    found = watch.rollouts(0)
    frame, box = found.key // bank().each, found.key % bank().each
    assert len(found.key) > 100 and bool((found.key.diff() >= 0).all())
    root = followed().qpos[frame, :3]
    off = (found.qpos[:, :3] - root).norm(dim=1)
    assert 0.0 < float(off.median()) < 0.3 and float(off.max()) < 0.8
    boxed = followed().boxed[followed().clip[frame]]
    away = (found.box[:, :3] - followed().box[frame, :3]).norm(dim=1)[boxed]
    assert float(away.median()) < 0.1
    # the next state of the same episode is a step of physics from it
    seen = {name: torch.stack([row[name] for row in watch._seen]) for name in watch._seen[0]}
    step, slot = 40, int(torch.nonzero(went_on(seen["episode"], seen["ends"])[40])[0])
    now = {name: value[step, slot] for name, value in seen.items()}
    variant = int(followed().clip[now["frame"]]) * bank().each + int(now["key"]) % bank().each
    scenes = Scenes([bank().models[variant]], WORLD.action_scale, WORLD.action_clip)
    shown = TrackScene(variant, int(now["frame"]))
    shown.put(scenes, now)
    scenes.drive(scenes.set_points(torch.zeros(1, 28), shown.set_point()))
    assert torch.allclose(scenes.qpos[0].float(), seen["qpos"][step + 1, slot], atol=2e-3)
    assert int(box.max()) == bank().each - 1


class TrackScene:
    """One scene at a frame of the reference, its clip's world at the origin."""

    def __init__(self, variant: int, frame: int) -> None:
        self._sampler = TrackSampler(WORLD, bank(), 0)
        choice = (variant % bank().each + 0.5) / bank().each
        states = self._sampler.at(torch.tensor([frame]), torch.tensor([choice]))
        self._states, self._frame = states, frame

    def put(self, scenes: Scenes, now: dict[str, Tensor]) -> None:
        zero = torch.zeros(1, 3)
        states = replace(
            self._states,
            origin=zero,
            qpos=now["qpos"][None],
            qvel=now["qvel"][None],
            box=now["box"][None],
            box_velocity=now["box_velocity"][None],
        )
        self._sampler.apply(scenes, torch.tensor([0]), states)

    def set_point(self) -> Tensor:
        ahead = followed().ahead(torch.tensor([self._frame]), 1)
        return followed().set_point[ahead]
