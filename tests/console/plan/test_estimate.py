"""Estimates by hand, and against what the stand-in fleets of bench scaling measured."""

from dataclasses import replace

import pytest

from console.plan.estimate import Costs, Fleet, act_flop, best_actors, estimate, update_flop

FLEET = Fleet(
    actors=4, scenes=1024, horizon=8, epochs=3, hidden=(512, 256), goal=29, gbit_per_s=1e6
)
COSTS = Costs(
    world_s=100e-6, act_s=1e-10, update_s=1e-11, score_s=5e-6, train_s=0.05, part_s=1e-3,
    receive_s=1e-6,
)  # fmt: skip


def test_an_iteration_by_hand() -> None:
    # (144 · 512) + (513 · 256) + (257 · 28)
    assert FLEET.weights == 212_252
    assert act_flop(FLEET) == 424_504
    assert update_flop(FLEET) == 2 * 3 * 6 * 212_252
    found = estimate(FLEET, COSTS)
    samples = 8192
    assert found.rollout_s == pytest.approx(256 * 8 * (100e-6 + 424_504e-10))
    assert found.intake_s == pytest.approx(4e-3 + samples * 1e-6)
    update = samples * 7_641_072e-11 / 2
    assert found.update_s == pytest.approx(update)
    # the training of the discriminator ends before the update
    assert found.style_s == pytest.approx(samples * 5e-6)
    learner = found.intake_s + found.style_s + update
    assert found.iteration_s == pytest.approx(found.rollout_s + learner)
    assert found.bottleneck == "update"
    ahead = estimate(replace(FLEET, overlap=True), COSTS)
    assert ahead.iteration_s == pytest.approx(max(found.rollout_s, learner))
    assert ahead.samples_per_s == pytest.approx(samples / ahead.iteration_s)
    slow = estimate(FLEET, replace(COSTS, train_s=1.0))
    assert slow.style_s == pytest.approx(samples * 5e-6 + 1.0 - update)


def test_bytes_by_hand() -> None:
    # state 114, goal 29, action and mean 28 each, log-probability, reward; three flags
    assert FLEET.sample_bytes == 4 * (114 + 29 + 56 + 2) + 3
    found = estimate(FLEET, COSTS)
    assert found.rollout_bytes == 8192 * 807
    assert found.weight_bytes == 4 * 212_252
    # one gigabit a second takes 52.9 ms for them, longer than the 12 ms of receiving
    narrow = estimate(replace(FLEET, gbit_per_s=1.0), COSTS)
    assert narrow.intake_s == pytest.approx(8 * 8192 * 807 / 1e9)
    slow = estimate(replace(FLEET, gbit_per_s=0.001), COSTS)
    assert slow.bottleneck == "network"


#: docs/results/throughput.md, `bench scaling --scenes 256`: actors, samples/s overlapped, and
#: relative to ideal in lockstep. Beyond these the stand-ins fill the two cores themselves.
MEASURED = ((1, 6_965, 0.97), (4, 27_900, 0.94), (16, 108_700, 0.87), (64, 417_100, None))


@pytest.mark.parametrize(("actors", "rate", "lockstep"), MEASURED)
def test_within_15_percent_of_the_stand_in_fleets(
    actors: int, rate: float, lockstep: float | None
) -> None:
    part_s = 2048 / 6_988
    costs = replace(Costs(), world_s=part_s / 2048, act_s=0.0, update_s=0.0)
    fleet = replace(FLEET, actors=actors, scenes=256 * actors, style=False, overlap=True)
    assert estimate(fleet, costs).samples_per_s == pytest.approx(rate, rel=0.15)
    if lockstep is not None:
        found = estimate(replace(fleet, overlap=False), costs)
        assert found.to_ideal == pytest.approx(lockstep, rel=0.15)


def test_enough_actors_and_no_more() -> None:
    fleet = replace(FLEET, scenes=64 * 64)
    enough = best_actors(fleet, COSTS, block=64)
    rates = [estimate(replace(fleet, actors=n), COSTS).samples_per_s for n in range(1, 65)]
    assert rates[enough - 1] >= 0.9 * max(rates) > rates[enough - 2]
