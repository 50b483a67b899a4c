"""The PPO update: what it must and must not change, and that it is the same every time."""

from dataclasses import replace

import pytest
import torch

from actors.local import LocalFleet
from learner.config import LearnerConfig
from learner.ppo import Learner
from learner.returns import advantages
from policy.model.acting import Policy
from policy.rollout import Rollout
from tests.support.learning.learners import CONFIG, bold, collect, learner, numbers, same
from tests.support.point_shard import ACTION, GOAL, STATE, PointShard, next_goals
from tests.support.successors import next_states
from world.precision import FLOAT32
from world.reflection import Reflection, Symmetry


def test_same_input_same_bits_on_one_thread_or_two():
    one, two, again = learner(threads=1), learner(threads=2), learner(threads=2)
    got = collect(one)
    metrics = [numbers(x.update(got, got.rewards, 0.3)) for x in (one, two, again)]
    metrics += [numbers(x.update(got, got.rewards, 0.3)) for x in (one, two, again)]
    assert metrics[0] == metrics[1] == metrics[2] and metrics[3] == metrics[4] == metrics[5]
    assert same(one.policy_state(), two.policy_state())
    assert same(one.policy_state(), again.policy_state())


def test_first_step_has_ratio_one_and_the_gradient_of_the_plain_objective():
    """One epoch of one minibatch: ratio 1, so the surrogate is -mean(A) = 0 and the KL 0."""
    held = learner(epochs=1, minibatch=10_000)
    got = collect(held)
    metrics = held.update(got, got.rewards, 0.3)
    assert metrics["ppo/kl"] < 1e-8
    assert metrics["ppo/clip_fraction"] == 0.0
    assert abs(metrics["ppo/surrogate"]) < 1e-4


def test_prepared_targets_are_the_textbook_ones():
    held = bold(learner())
    held.normaliser.update(torch.randn(500, STATE + GOAL) * 2)
    held.values.update(torch.randn(50) * 3 + 5)
    got = collect(held, horizon=40)
    assert got.fell.any() and got.timed_out.any()

    def value(states, goals):
        x = held.normaliser(torch.cat((states, goals), -1))
        return held.values.denormalise(held.critic(x).detach())

    values = value(got.states[:-1], got.goals[:-1])
    following = value(next_states(got), next_goals(got))
    gains = advantages(
        got.rewards, values, following, got.fell, got.timed_out, got.valid, 0.9, 0.8
    ).reshape(-1)
    raw = held.normaliser(torch.cat((got.states, got.goals), -1))
    batch, _ = held._prepare(got, got.rewards, raw)
    expected = (gains - gains.mean()) / gains.std()
    torch.testing.assert_close(batch.advantages, expected, rtol=1e-3, atol=1e-4)
    returns = gains + values.reshape(-1)
    torch.testing.assert_close(
        held.values.denormalise(batch.targets), returns, rtol=1e-4, atol=1e-4
    )


def test_moving_the_value_normaliser_keeps_the_critics_predictions():
    held = learner()
    held.values.update(torch.randn(100) * 2 + 3)
    x = torch.randn(30, STATE + GOAL)
    before = held.values.denormalise(held.critic(x).detach())
    held._update_values(torch.randn(100) * 50 + 20)
    torch.testing.assert_close(
        held.values.denormalise(held.critic(x).detach()), before, rtol=1e-4, atol=1e-3
    )


def test_warm_up_trains_the_critic_only_and_then_ends():
    held = learner(warmup_iterations=2)
    got = collect(held)
    states = [held.policy_state()]
    for _ in range(3):
        held.update(got, got.rewards, 0.3)
        states.append(held.policy_state())
    assert same(states[0]["actor"], states[2]["actor"])
    assert not same(states[0]["critic"], states[1]["critic"])
    assert not same(states[2]["actor"], states[3]["actor"])


def test_the_average_is_the_geometric_mean_of_the_actors_since_the_warm_up():
    held = learner(warmup_iterations=1, average=0.75)
    got = collect(held)
    with torch.no_grad():
        held.actor.layers[0].weight.mul_(2.0)  # as cloning would
    seen = []
    for _ in range(3):
        held.update(got, got.rewards, 0.3)
        seen.append(held.actor.layers[0].weight.detach().clone())
    expected = (seen[0] * 0.75 + seen[1] * 0.25) * 0.75 + seen[2] * 0.25
    torch.testing.assert_close(held.average.layers[0].weight, expected)
    assert not torch.equal(expected, seen[2])
    other = learner()
    other.load_policy_state(held.policy_state())
    assert torch.equal(other.average.layers[0].weight, held.average.layers[0].weight)
    old = held.policy_state()
    del old["average"]
    other.load_policy_state(old)
    assert torch.equal(other.average.layers[0].weight, seen[2])


def test_actor_does_not_step_beyond_its_kl_limit():
    held = learner(epochs=1)
    got = collect(held)
    # as if the rollout's policy had been one whole unit away: KL = ½ · 2 · 1 / 0.3² = 11
    before = held.policy_state()
    metrics = held.update(replace(got, means=got.means + 1.0), got.rewards, 0.3)
    assert metrics["ppo/skipped"] == 4.0 and metrics["ppo/kl"] > 10
    assert same(before["actor"], held.policy_state()["actor"])
    assert metrics["ppo/learning_rate"] == pytest.approx(1e-4 / 1.3)


def test_first_steps_are_small_whatever_the_gradient():
    """Adam's first step is the rate itself: the ramp makes it a fortieth of that."""
    held = learner(epochs=1, minibatch=10_000, actor_rate=1e-3)
    got = collect(held)
    before = held.actor.layers[0].weight.detach().clone()
    metrics = held.update(got, got.rewards, 0.3)
    step = (held.actor.layers[0].weight.detach() - before).abs().max()
    assert float(step) == pytest.approx(1e-3 / 40, rel=1e-2)
    # no reason to raise the rate yet
    assert metrics["ppo/learning_rate"] == 1e-3


def test_a_broken_scene_changes_nothing_else():
    """A sample that is not valid is as good as absent: its numbers reach neither network."""
    one, other = learner(), learner()
    got = collect(one, broken=(4, 11))
    assert int((~got.valid).sum()) == 1
    twisted = replace(
        got,
        rewards=torch.where(got.valid, got.rewards, float("inf")),
        actions=torch.where(got.valid[..., None], got.actions, float("nan")),
    )
    first = numbers(one.update(got, got.rewards, 0.3))
    second = numbers(other.update(twisted, twisted.rewards, 0.3))
    assert first == second
    assert same(one.policy_state(), other.policy_state())


def test_observation_normaliser_moves_after_the_update_only():
    held = learner()
    got = collect(held)
    published = held.weights()
    held.update(got, got.rewards, 0.3)
    assert torch.equal(published["normaliser.mean"], torch.zeros(STATE + GOAL))
    rows = torch.cat((got.states, got.goals), -1)[:-1].reshape(-1, STATE + GOAL)
    torch.testing.assert_close(held.weights()["normaliser.mean"], rows.mean(0))


def test_minibatches_are_a_fresh_equal_division_each_epoch():
    held = learner(minibatch=64)
    epochs = held._minibatches(200, 0)
    assert [[len(rows) for rows in epoch] for epoch in epochs] == [[67, 67, 66]] * 3
    for epoch in epochs:
        assert torch.cat(epoch).sort().values.tolist() == list(range(200))
    assert not torch.equal(epochs[0][0], epochs[1][0])
    assert not torch.equal(epochs[0][0], held._minibatches(200, 1)[0][0])


def test_learns_to_reach_the_target():
    """A point moves to its target: from about 0.4 a step at random to 0.8 and more, of 1."""
    held = learner(hidden=(32, 32), gamma=0.95, lam=0.95, actor_rate=3e-4, minibatch=128)
    fleet = LocalFleet(lambda owned: PointShard(owned, 5), 128, 16, 2, seed=5, horizon=8)
    returns = []
    for _ in range(45):
        got = fleet.collect(held.weights(), held.version, held.sigma)
        held.update(got, got.rewards, held.sigma)
        returns += got.episodes["return"].tolist()
    fleet.close()
    assert sum(returns[:64]) / 64 < 13
    assert sum(returns[-64:]) / 64 > 18


def swapped(rollout: Rollout) -> Rollout:
    """The same with the two axes of the plane exchanged."""
    change = {
        name: getattr(rollout, name).flip(-1) for name in ("goals", "actions", "means", "end_goals")
    }
    for name in ("states", "end_states"):
        change[name] = getattr(rollout, name)[..., [1, 0, 2, 3]]
    return replace(rollout, **change)


def test_networks_of_one_side_learn_the_same_from_both():
    """A task's mirror image is one experience more, not another experience."""
    observation = Reflection(torch.tensor([1, 0, 2, 3, 5, 4]), torch.ones(6))
    action = Reflection(torch.tensor([1, 0]), torch.ones(2))
    # the diagonal, which the state's constants are, and the goal: left of it or right
    sides = Symmetry(observation, action, torch.tensor([2, 3, 4, 5]))

    def one() -> Learner:
        return Learner(STATE + GOAL, ACTION, CONFIG, seed=3, precision=FLOAT32, symmetry=sides)

    held, other = one(), one()
    rollout = collect(held)
    right = rollout.goals[..., 1] < rollout.goals[..., 0]
    assert 0.2 < float(right.float().mean()) < 0.8
    held.update(rollout, rollout.rewards, 0.3)
    other.update(swapped(rollout), rollout.rewards, 0.3)
    assert same(held.policy_state(), other.policy_state())
    plain = learner()
    plain.update(rollout, rollout.rewards, 0.3)
    assert not same(held.policy_state(), plain.policy_state())


def test_the_imitation_loss_draws_the_policy_to_the_teacher():
    """One component is labelled and approaches the teacher's action. Without a weight the labels
    change nothing."""
    # the rollout stays the same, so that the KL from its policy grows without a limit
    held, free = learner(imitation_weight=3.0, kl_target=((0.0, 1e3),)), learner()
    rollout = collect(free)
    labels = torch.full_like(rollout.actions, float("nan"))
    labels[..., 0] = 0.4
    labelled = replace(rollout, teacher_action=labels)

    def off() -> float:
        policy = Policy(held.weights())
        means = policy(rollout.states.flatten(0, 1), rollout.goals.flatten(0, 1))
        return float((means[:, 0] - 0.4).abs().mean())

    before = off()
    metrics = {}
    for _ in range(40):
        metrics = held.update(labelled, rollout.rewards, 0.3)
    assert off() < 0.25 * before and metrics["ppo/imitation"] < 1.0
    one, other = learner(), learner()
    assert "ppo/imitation" in one.update(labelled, rollout.rewards, 0.3)
    assert "ppo/imitation" not in other.update(rollout, rollout.rewards, 0.3)
    assert same(one.policy_state(), other.policy_state())


def test_the_weight_of_the_imitation_falls_to_nothing():
    """Kickstarting: halfway half of it counts, afterwards labels change nothing."""
    config = LearnerConfig(imitation_weight=0.3, imitation_samples=1000)
    assert [config.imitation(n) for n in (0, 500, 1000, 5000)] == pytest.approx([0.3, 0.15, 0, 0])
    assert LearnerConfig(imitation_weight=0.3).imitation(5000) == 0.3
    spent, plain = learner(imitation_weight=3.0, imitation_samples=1), learner()
    assert not spent.untaught and not plain.untaught
    rollout = collect(plain)
    labels = torch.full_like(rollout.actions, 0.4)
    spent.samples = plain.samples = 1
    assert spent.untaught and not plain.untaught, "without a weight nothing was taught"
    spent.update(replace(rollout, teacher_action=labels), rollout.rewards, 0.3)
    plain.update(rollout, rollout.rewards, 0.3)
    assert same(spent.policy_state(), plain.policy_state())


def test_networks_say_the_same_while_their_normaliser_moves():
    """Also where another task's moments are far from those of the scenes; but for what was
    constant, of which the networks could know nothing."""
    # without clipping, which depends on the moments themselves
    held = learner(warmup_iterations=9, skip=True, observation_clip=1e3)
    assert held.actor.skip is not None
    torch.nn.init.normal_(held.actor.skip.weight, std=0.1)
    held.average.load_state_dict(held.actor.state_dict())
    known = 0.5 * torch.randn(1000, STATE + GOAL) - 0.3
    known[:, 2] = 1.0
    held.normaliser.update(known)
    rollout = collect(held)
    x = torch.cat((rollout.states, rollout.goals), -1)
    x[..., 2:4] = known[0, 2:4]

    def said() -> tuple[torch.Tensor, torch.Tensor]:
        with torch.no_grad():
            return held.actor(held.normaliser(x)), held.average(held.normaliser(x))

    before, mean, critic = (
        said(),
        held.normaliser.mean.clone(),
        held.critic.layers[0].weight.clone(),
    )
    held.update(rollout, rollout.rewards, 0.3)
    assert (held.normaliser.mean - mean).abs().max() > 0.1
    for now, then in zip(said(), before, strict=True):
        torch.testing.assert_close(now, then, atol=2e-4, rtol=1e-3)
    assert not torch.equal(held.critic.layers[0].weight, critic)


def test_every_seed_that_the_command_line_takes_gives_minibatches_of_its_own() -> None:
    """The generator refuses more than 64 bits: a seed of nanoseconds ended the first update."""
    found = []
    for seed in (0, 3, 1_750_000_000_000_000_000, 2**63 - 1):
        held = Learner(STATE + GOAL, ACTION, CONFIG, seed=seed, precision=FLOAT32)
        found += [held._minibatches(64, part)[0][0].tolist() for part in (0, 1)]  # pyright: ignore
        held.close()
    assert len({tuple(order) for order in found}) == 8
