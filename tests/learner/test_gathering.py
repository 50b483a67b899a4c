"""Rollouts begun ahead: which weights act in them, and what becomes of their errors."""

import threading

import pytest

from actors.local import LocalFleet
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.learning.loops import (
    HORIZON,
    SAMPLES,
    SCENES,
    Slowness,
    Watched,
    assert_same,
    looped,
    overlapped,
    points,
)


def test_the_policy_that_acts_is_one_update_old(tmp_path):
    fleet = Watched(points())
    loop = looped(tmp_path, fleet, overlapped(5), Slowness())
    published = []
    for _ in range(5):
        published.append(loop.learner.weights())
        loop.recorder.record(loop.learner.version, loop.iterate())
    loop.close()
    lines = [metrics for _, metrics in loop.recorder.lines]
    assert [m["lag/policy"] for m in lines] == [0, 1, 1, 1, 1]
    assert [m["lag/style"] for m in lines] == [0] * 5
    assert [m["samples"] for m in lines] == [SAMPLES * i for i in range(1, 6)]
    # The sixth is begun and not learned from yet.
    assert [version for _, version, _ in fleet.asked] == [0, 0, 1, 2, 3, 4]
    for weights, version, sigma in fleet.asked:
        assert_same(weights, published[version])
        assert sigma == pytest.approx(0.3 - 0.2 * version * SAMPLES / 3000)
    # The rollouts are those of a fleet that is asked for them one after the other.
    alone = points(1)
    for (weights, version, sigma), rollout in zip(fleet.asked, fleet.gave, strict=True):
        assert_same(rollout.tensors(), alone.collect(weights, version, sigma).tensors())
    for held in (fleet, alone):
        held.close()
    # Learned from with the noise that acted: that of two versions ago in the sigma of the line.
    assert [m["ppo/sigma"] for m in lines] == [s for _, _, s in fleet.asked[:5]]


def test_actors_act_while_the_learner_learns(tmp_path):
    learning, acting = threading.Event(), threading.Event()
    seen = []

    class Waiting(Watched):
        def collect(self, weights, version, sigma) -> Rollout:
            if self.asked:  # the first one has nothing to overlap with
                acting.set()
                seen.append(learning.wait(60))
            return super().collect(weights, version, sigma)

    fleet = Waiting(points())
    loop = looped(tmp_path, fleet, overlapped(1))
    update = loop.learner.update

    def patient(*arguments):
        learning.set()
        seen.append(acting.wait(60))
        return update(*arguments)

    loop.learner.update = patient
    loop.iterate()
    loop.close()
    fleet.close()
    assert seen == [True, True], "each waited until the other had begun"


def test_an_error_of_a_rollout_ahead_surfaces_as_itself(tmp_path):
    fleet = LocalFleet(
        MakePoints(fault="raise", at=2 * HORIZON + 1), SCENES, 8, 2, seed=5, horizon=HORIZON
    )
    loop = looped(tmp_path, fleet, overlapped(9))
    with pytest.raises(ArithmeticError, match="the seat fell through the floor"):
        loop.run()
    assert [i for i, _ in loop.recorder.lines] == [1, 2], "what was there was learned from first"
    loop.close()
    fleet.close()
