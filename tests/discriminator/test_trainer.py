"""The in-process discriminator: rewards, training, idempotence and exact resume."""

from dataclasses import replace

import pytest
import torch

from discriminator.errors import StyleError
from discriminator.trainer import Discriminator
from tests.support.style_cases import (
    SMALL,
    WIDTH,
    Mocap,
    assert_equal_states,
    discriminator,
    iterate,
    rollout,
)
from world.errors import LayoutError


def test_reward_is_of_the_normalised_pair() -> None:
    style = discriminator()
    batch = rollout(0)
    scores = style.score(0, **batch)
    assert scores.reward.shape == (4, 16)
    assert scores.version == 0
    assert scores.reward[0, 1] == 0.0
    pair = torch.cat([batch["rollout_states"][1, 2], batch["end_states"][0]])
    normalised = ((pair - style.mean.repeat(2)) / style.deviation.repeat(2)).clamp(-10, 10)
    logit = style.logits(normalised[None])
    assert scores.reward[1, 2] == pytest.approx(float(torch.log1p(logit.exp())), abs=1e-6)
    assert style.replay.size == 4 * 16 - 1


def test_it_learns_to_separate_policy_from_mocap_and_rewards_mocap_more() -> None:
    style = discriminator(replace(SMALL, gradient_penalty=0.1, learning_rate=3e-3))
    iterate(style, 0, 60)
    scores = style.score(99, **rollout(99))
    assert scores.metrics["style/accuracy_policy"] > 0.85
    assert style.train(60)["style/accuracy_mocap"] > 0.85
    states, successors = Mocap().held_out(32, 0)
    like = style.score(
        100,
        torch.stack([states, successors]),
        torch.zeros(0, 2, dtype=torch.int64),
        torch.zeros(0, WIDTH),
        torch.ones(1, 32, dtype=torch.bool),
    )
    assert like.reward.mean() > 2 * scores.reward.mean()


def test_the_throttle_skips_trainings_while_both_accuracies_are_above_it() -> None:
    """With a bound of 0.8 each training is skipped exactly where the figures of its version say."""
    config = replace(SMALL, gradient_penalty=0.1, learning_rate=3e-3, throttle=0.8)
    style, free = discriminator(config), discriminator(replace(config, throttle=None))
    skipped = []
    for k in range(60):
        on_policy = style.score(k, **rollout(k)).metrics["style/accuracy_policy"]
        before = {name: value.clone() for name, value in style.network.state_dict().items()}
        figures = style.train(k)
        free.score(k, **rollout(k))
        free.train(k)
        right = min(on_policy, figures["style/accuracy_mocap"]) > 0.8
        assert figures["style/skipped"] == float(right)
        same = all(torch.equal(before[n], v) for n, v in style.network.state_dict().items())
        assert same == right and ("style/loss" in figures) == (not right)
        skipped.append(right)
    assert 0 < sum(skipped) < 60 and style.version == 60
    gap = free.train(59)["style/logit_gap"]
    assert style.train(59)["style/logit_gap"] < gap  # it stays nearer to undecided
    again = discriminator(config)
    again.load_state_dict(style.state_dict())
    for each in (style, again):
        each.score(60, **rollout(60))
    assert style.train(60) == again.train(60)
    # a later stage of a recipe may have no throttle, or other steps: what it saves loads again
    for later in (replace(config, throttle=None), replace(config, steps_per_iteration=4)):
        third = discriminator(later)
        third.load_state_dict(style.state_dict())
        third.score(61, **rollout(61))
        third.train(61)
        fourth = discriminator(later)
        fourth.load_state_dict(third.state_dict())
        for each in (third, fourth):
            each.score(62, **rollout(62))
        assert third.train(62) == fourth.train(62)


def test_a_training_without_gradient_steps_measures_and_learns_nothing() -> None:
    style = discriminator(replace(SMALL, steps_per_iteration=0))
    style.score(0, **rollout(0))
    before = style.state_dict()
    found = style.train(0)
    assert style.version == 1 and "style/loss" not in found
    assert found["style/skipped"] == 0.0 and 0.0 <= found["style/accuracy_mocap"] <= 1.0
    after = style.state_dict()
    weights = [name for name in before if name.startswith("network/")]
    assert weights and all(torch.equal(before[name], after[name]) for name in weights)
    # as in the next stage of a recipe
    going_on = discriminator()
    going_on.load_state_dict(after)
    going_on.score(1, **rollout(1))
    assert going_on.train(1)["style/loss"] > 0.0
    assert not torch.equal(going_on.state_dict()[weights[0]], after[weights[0]])


def test_health_is_measured() -> None:
    style = discriminator()
    scores = style.score(0, **rollout(0))
    reward = scores.reward.flatten()
    valid = rollout(0)["valid"].flatten()
    spread = float(reward[valid].double().std())
    assert scores.metrics["style/reward_spread"] == pytest.approx(spread)
    figures = style.train(0)
    assert figures["style/gradient"] > 0.0 and figures["style/skipped"] == 0.0
    penalty = 0.5 * SMALL.gradient_penalty * figures["style/gradient"] ** 2
    assert figures["style/penalty"] == pytest.approx(penalty, rel=0.1)  # the square of a mean


def test_the_penalty_holds_the_slope_down() -> None:
    slopes = []
    for weight in (0.0, 20.0):
        style = discriminator(replace(SMALL, gradient_penalty=weight, learning_rate=3e-3))
        iterate(style, 0, 40)
        rows = torch.randn(200, 2 * WIDTH)
        slopes.append(style.network.input_gradient(style.network.with_activations(rows)[1]).norm())
    assert slopes[1] < 0.5 * slopes[0]


def test_a_batch_counts_once_and_a_training_happens_once() -> None:
    style = discriminator()
    first = style.score(5, **rollout(5))
    before = style.state_dict()
    again = style.score(5, **rollout(5))
    assert torch.equal(first.reward, again.reward)
    assert_equal_states(before, style.state_dict())
    metrics = style.train(0)
    trained = style.state_dict()
    assert style.train(0) == metrics
    assert_equal_states(trained, style.state_dict())
    assert style.score(5, **rollout(5)).version == 0  # a late retry: still what D_0 said
    with pytest.raises(StyleError, match="must be 1"):
        style.train(3)
    for batch in range(6, 20):
        style.score(batch, **rollout(batch))
    with pytest.raises(StyleError, match="batch 5: "):  # too late to know what it was worth
        style.score(5, **rollout(5))


def test_an_empty_replay_is_refused() -> None:
    with pytest.raises(StyleError, match="score a rollout first"):
        discriminator().train(0)


def test_same_seed_same_bits_and_another_seed_others() -> None:
    a, b, c = discriminator(), discriminator(), discriminator(seed=1)
    for style in (a, b, c):
        iterate(style, 0, 8)  # past the replay's capacity
    assert a.replay.size == SMALL.replay
    assert_equal_states(a.state_dict(), b.state_dict())
    assert not torch.equal(a.network.linears[0].weight, c.network.linears[0].weight)


@pytest.mark.parametrize("between", [False, True])
def test_resume_is_exact(between: bool) -> None:
    whole = discriminator()
    iterate(whole, 0, 4)
    if between:  # stopped after scoring, before training
        whole.score(4, **rollout(4))
    state = {k: v.clone() for k, v in whole.state_dict().items()}
    other = discriminator(seed=9)
    iterate(other, 0, 1)
    other.load_state_dict(state)
    assert_equal_states(state, other.state_dict())
    rest = [iterate(style, 4, 9) for style in (whole, other)]
    assert all(torch.equal(a, b) for a, b in zip(*rest, strict=True))
    assert_equal_states(whole.state_dict(), other.state_dict())


def test_a_state_of_another_layout_is_refused_and_changes_nothing() -> None:
    style = discriminator()
    before = style.state_dict()
    other = discriminator(replace(SMALL, hidden=(32, 8))).state_dict()
    with pytest.raises(LayoutError, match=r"network/layers\.1"):
        style.load_state_dict(other)
    with pytest.raises(LayoutError, match="at most 300"):
        big = discriminator(replace(SMALL, replay=1000))
        iterate(big, 0, 8)
        style.load_state_dict(big.state_dict())
    del before["normaliser/mean"]
    with pytest.raises(LayoutError, match="normaliser/mean is missing"):
        style.load_state_dict(before)


def test_numbers_that_are_not_finite_are_refused_unless_marked() -> None:
    style, batch = discriminator(), rollout(0)
    batch["rollout_states"][3, 5, 2] = float("nan")
    with pytest.raises(StyleError, match="2 valid transitions are not finite"):
        style.score(0, **batch)
    assert style.replay.size == 0
    batch["valid"][2:4, 5] = False
    scores = style.score(0, **batch)
    assert scores.reward.isfinite().all()
    assert style.replay.rows[: style.replay.size].isfinite().all()


def test_without_object_features_the_object_is_not_seen() -> None:
    mask = torch.zeros(WIDTH, dtype=torch.bool)
    mask[-2:] = True
    config = replace(SMALL, object_features=False)
    style = Discriminator(config, Mocap(), 0, object_mask=mask)
    blind, batch = Discriminator(config, Mocap(), 0, object_mask=mask), rollout(0)
    moved = dict(
        batch,
        rollout_states=batch["rollout_states"] + 5 * mask,
        end_states=batch["end_states"] - 1.0 * mask,
    )
    assert torch.equal(style.score(0, **batch).reward, blind.score(0, **moved).reward)
    assert style.network.linears[0].in_features == 2 * (WIDTH - 2)
    with pytest.raises(StyleError, match="object_mask"):
        Discriminator(config, Mocap(), 0)


class Long(Mocap):
    """Windows of five states."""

    def sample(self, n: int, counter: int) -> tuple[torch.Tensor, ...]:
        first, _ = super().sample(n, counter)
        return tuple(first + 0.1 * k for k in range(5))


def test_longer_windows_learn_resume_exactly_and_reward_their_whole_ones() -> None:
    config = replace(SMALL, window=5)
    one, other = (Discriminator(config, Long(), 0) for _ in range(2))
    assert one.network.linears[0].in_features == 5 * WIDTH
    assert one.replay.capacity == 2 * SMALL.replay // 5
    first = one.score(0, **rollout(0, steps=2))
    assert one.replay.size == 0, "no window is whole yet"
    assert float(first.reward.std()) == 0.0
    for k in range(1, 4):
        scores = one.score(k, **rollout(k))
        one.train(k - 1)
    assert one.replay.size > 20
    # the episode of scene 2 ended at step 1: what follows has the mean of the whole windows
    whole = torch.ones(4, 16, dtype=torch.bool)
    whole[2:, 2] = False
    whole[0, 2] = False  # as that of the rollout before did, so that one of four is whole
    whole[1:4, 1] = False  # and scene 1 became invalid at step 0
    whole[:3, 0] = False  # and scene 0 ended with the rollout before
    valid = rollout(0)["valid"]
    mean = scores.reward[whole & valid].mean()
    torch.testing.assert_close(scores.reward[2:, 2], mean.expand(2))
    other.load_state_dict(one.state_dict())
    batch = rollout(9)
    assert torch.equal(one.score(9, **batch).reward, other.score(9, **batch).reward)
    with pytest.raises(StyleError, match="window 5: the mocap has windows of 2"):
        Discriminator(config, Mocap(), 0)
    wrong = one.state_dict() | {"age": torch.full((16,), 9)}
    with pytest.raises(LayoutError, match="age must be 0 to 3"):
        other.load_state_dict(wrong)
