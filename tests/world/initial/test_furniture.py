"""Initial states with furniture: shares, distances, and a seat that fits the clip."""

from dataclasses import replace

import pytest
import torch

from world import rotations
from world.config import InitialStates, WorldConfig
from world.errors import ClipError
from world.furniture.catalogue import catalogue
from world.initial.furniture import FurnitureSampler, furniture_pose
from world.motions import load
from world.motions.library import MotionLibrary
from world.objects.furniture_bank import FurnitureBank, variants

CONFIG = WorldConfig(pieces=8, scales=2)


@pytest.fixture(scope="module")
def library() -> MotionLibrary:
    return MotionLibrary(load.own_clips())


@pytest.fixture(scope="module")
def bank() -> FurnitureBank:
    return FurnitureBank(variants(catalogue("train", CONFIG.pieces), CONFIG.scales, CONFIG.scale))


def test_starts_are_where_they_say(library: MotionLibrary, bank: FurnitureBank) -> None:
    anywhere = replace(
        CONFIG, initial=InitialStates(0.3, 0.35, 0.35, ahead_fraction=0.0, front_fraction=0.0)
    )
    sampler = FurnitureSampler(anywhere, library, bank, 0)
    n = 4096
    starts = sampler.draw(torch.arange(n), torch.ones(n, dtype=torch.int64))
    shares = torch.bincount(starts.kind, minlength=3) / n
    torch.testing.assert_close(shares, torch.tensor([0.3, 0.35, 0.35]), atol=0.03, rtol=0)
    assert starts.qpos[:, :2].abs().max() == 0
    distance = starts.point.norm(dim=1)
    far, near = starts.kind == 2, starts.kind == 1
    assert 1.0 <= distance[far].min() < 1.1
    assert 9.9 < distance[far].max() <= 10.0
    assert CONFIG.initial.near_m[0] <= distance[near].min()
    assert distance[near].max() <= CONFIG.initial.near_m[1]
    # any bearing and any yaw: the mean directions vanish
    assert (starts.point[far] / distance[far, None]).mean(0).norm() < 0.06
    assert starts.facing[far].mean(0).norm() < 0.06
    # the furniture stands so that its own place is where the start has it
    origin, yaw = furniture_pose(bank, starts)
    point = bank.point[starts.variant]
    c, s = yaw.unbind(1)
    x = origin[:, 0] + c * point[:, 0] - s * point[:, 1]
    y = origin[:, 1] + s * point[:, 0] + c * point[:, 1]
    torch.testing.assert_close(torch.stack((x, y), 1), starts.point, atol=1e-5, rtol=0)


def test_front_starts_stand_before_the_seat(library: MotionLibrary, bank: FurnitureBank) -> None:
    before = replace(CONFIG, initial=InitialStates(0, 1, 0, front_fraction=1.0))
    n = 2048
    starts = FurnitureSampler(before, library, bank, 0).draw(
        torch.arange(n), torch.ones(n, dtype=torch.int64)
    )
    distance = starts.point.norm(dim=1)
    assert CONFIG.initial.front_m[0] <= distance.min() < distance.max() <= CONFIG.initial.front_m[1]
    ahead = (-starts.point * starts.facing).sum(dim=1) / distance
    assert ahead.min() >= 0.5 - 1e-4  # 60 degrees
    assert ahead.max() > 0.999
    # half within a quarter of the distances, half turned within 45 degrees of where it faces
    near = CONFIG.initial.front_m[0] + 0.25 * (
        CONFIG.initial.front_m[1] - CONFIG.initial.front_m[0]
    )
    assert (distance < near).float().mean().item() == pytest.approx(0.5, abs=0.05)
    cosine = (rotations.heading(starts.qpos[:, 3:7]) * starts.facing).sum(dim=1)
    assert (cosine > 0.5**0.5).float().mean().item() == pytest.approx(0.5, abs=0.05)
    assert cosine.min() < -0.99


def test_some_far_starts_walk_on_towards_the_place(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    only_far = replace(
        CONFIG, initial=InitialStates(0, 0, 1, ahead_fraction=1.0, standing_fraction=0.0)
    )
    starts = FurnitureSampler(only_far, library, bank, 0).draw(
        torch.arange(512), torch.ones(512, dtype=torch.int64)
    )
    speed = starts.qvel[:, :2].norm(dim=1)
    walking = speed > 0.3
    course = starts.qvel[walking, :2] / speed[walking, None]
    bearing = starts.point[walking] / starts.point[walking].norm(dim=1, keepdim=True)
    assert walking.float().mean() > 0.5
    assert ((course * bearing).sum(1) > 0.7070).all()


def test_clip_starts_choose_a_seat_of_the_clips_height(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    heights = torch.tensor([0.30, 0.42, 0.70])
    chosen = bank.of_height(heights, torch.tensor([0.0, 0.5, 0.99]))
    error = (bank.point[chosen, 2] - heights).abs()
    best = (bank.point[:, 2][None] - heights[:, None]).abs().min(dim=1).values
    assert (error <= best + 0.08).all()


def test_clips_without_a_seat_are_refused_for_clip_starts(bank: FurnitureBank) -> None:
    walking = [clip for clip in load.own_clips() if clip.seat is None]
    only = MotionLibrary(walking)
    with pytest.raises(ClipError, match="no clip uses a seat"):
        FurnitureSampler(CONFIG, only, bank, 0)
    FurnitureSampler(WorldConfig(initial=InitialStates(0, 1, 1)), only, bank, 0)


def test_pieces_that_fail_are_drawn_more_often(library: MotionLibrary, bank: FurnitureBank) -> None:
    config = replace(CONFIG, initial=InitialStates(0, 0.5, 0.5, focus=0.5))
    sampler, n = FurnitureSampler(config, library, bank, 0), 8192
    scenes, episodes = torch.arange(n), torch.ones(n, dtype=torch.int64)
    pieces = len(bank) // CONFIG.scales

    def shares() -> torch.Tensor:
        drawn = sampler.draw(scenes, episodes).variant // CONFIG.scales
        return torch.bincount(drawn, minlength=pieces) / n

    even = torch.full((pieces,), 1 / pieces)
    torch.testing.assert_close(shares(), even, atol=0.015, rtol=0)
    # half are drawn evenly, half by the rates, whose sum is 0.8 + 0.2 (the mean of those known
    # for the last five: 0.5)
    rates = torch.tensor([0.8, 0.2, 0.5])
    sampler.update_sampling(
        {"piece_sit": rates, "piece_lie": 1.0 - rates, "failures": torch.ones(3)}
    )
    weights = torch.cat((rates, torch.full((pieces - 3,), 0.5)))
    wanted = 0.5 / pieces + 0.5 * weights / weights.sum()
    torch.testing.assert_close(shares(), wanted, atol=0.015, rtol=0)
    # nothing fails: evenly again
    sampler.update_sampling({"piece_sit": torch.zeros(pieces)})
    torch.testing.assert_close(shares(), even, atol=0.015, rtol=0)


def test_episodes_that_began_near_tell_their_piece(
    library: MotionLibrary, bank: FurnitureBank
) -> None:
    variant, kind = torch.tensor([0, 3, 5, 4]), torch.tensor([1, 1, 1, 2])
    plain = FurnitureSampler(CONFIG, library, bank, 0)
    assert plain.episode_records(variant, kind) == {}
    config = replace(CONFIG, initial=InitialStates(focus=0.3))
    told = FurnitureSampler(config, library, bank, 0).episode_records(variant, kind)["piece_sit"]
    wanted = torch.tensor([0.0, 1.0, 2.0, torch.nan])
    torch.testing.assert_close(told, wanted, equal_nan=True)
