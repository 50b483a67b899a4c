"""Losses, reward, penalty, pairing and replay of the discriminator, against oracles."""

import math

import numpy as np
import pytest
import torch

from discriminator import loss, normaliser
from discriminator.errors import StyleError
from discriminator.network import StyleNetwork
from discriminator.pairing import check_rollout, next_states
from discriminator.replay import Replay


def network(inputs: int = 6, hidden: tuple[int, ...] = (16, 8)) -> StyleNetwork:
    net = StyleNetwork(inputs, hidden, torch.Generator().manual_seed(3))
    with torch.no_grad():
        net.linears[-1].weight.mul_(30.0)  # away from the small first logits
    return net.double()


def test_reward_is_minus_log_one_minus_d_clamped_once() -> None:
    logits = torch.tensor([0.0, math.log(3.0), -20.0, 50.0])
    reward = loss.style_reward(logits, clamp=1e-4, scale=2.0)
    # D = 1/2 and 3/4: -log(1/2), -log(1/4); far left 0; far right -log(1e-4).
    assert reward.tolist() == pytest.approx(
        [2 * math.log(2), 2 * math.log(4), 0, 8 * math.log(10)], abs=1e-6
    )


def test_classification_by_hand() -> None:
    policy = torch.tensor([0.0, math.log(3.0)])  # -log(1-D): log 2, log 4
    mocap = torch.tensor([math.log(3.0)])  # -log D: log 4/3
    expected = 0.5 * (math.log(2) + math.log(4)) / 2 + 0.5 * math.log(4 / 3)
    assert float(loss.classification(policy, mocap)) == pytest.approx(expected)


@pytest.mark.parametrize("hidden", [(16,), (16, 8), (12, 10, 8)])
def test_closed_form_penalty_equals_double_backward(hidden: tuple[int, ...]) -> None:
    net = network(hidden=hidden)
    x = torch.randn(50, 6, dtype=torch.float64, generator=torch.Generator().manual_seed(0))
    _, activations = net.with_activations(x)
    ours = loss.gradient_penalty(net.input_gradient(activations))
    ours.backward()
    by_weight = [layer.weight.grad for layer in net.linears]

    reference = network(hidden=hidden)
    x.requires_grad_()
    (gradient,) = torch.autograd.grad(reference(x).sum(), x, create_graph=True)
    penalty = 0.5 * gradient.square().sum(-1).mean()
    penalty.backward()
    torch.testing.assert_close(ours, penalty)
    for grad, layer in zip(by_weight, reference.linears, strict=True):
        torch.testing.assert_close(grad, layer.weight.grad)


def test_regularisation_by_hand() -> None:
    net = StyleNetwork(1, (1,), torch.Generator().manual_seed(0))
    with torch.no_grad():
        net.linears[0].weight.fill_(2.0)
        net.linears[1].weight.fill_(3.0)
        net.linears[0].bias.fill_(100.0)
    total = loss.regularisation(net, logit=0.1, decay=0.01).item()
    assert total == pytest.approx(0.9 + 0.13)


def test_successors_of_ended_episodes_are_their_last_states() -> None:
    states = torch.arange(3 * 2, dtype=torch.float32).reshape(3, 2, 1)
    after = next_states(states, torch.tensor([[0, 1], [1, 0]]), torch.tensor([[-1.0], [-2.0]]))
    assert after.squeeze(-1).tolist() == [[2.0, -1.0], [-2.0, 5.0]]
    assert states[1, 1, 0] == 3.0  # the rollout itself is left alone


def test_a_rollout_of_another_shape_is_refused_by_field() -> None:
    states, ends = torch.zeros(3, 2, 4), torch.zeros(0, 2, dtype=torch.int64)
    valid = torch.ones(2, 2, dtype=torch.bool)
    check_rollout(states, ends, torch.zeros(0, 4), valid, 4)
    wrong = [
        (states, ends, torch.zeros(0, 4), valid, 5, "states"),
        (states, ends.int(), torch.zeros(0, 4), valid, 4, "end_index"),
        (states, torch.tensor([[2, 0]]), torch.zeros(1, 4), valid, 4, "end_index"),
        (states, torch.tensor([[0, -1]]), torch.zeros(1, 4), valid, 4, "end_index"),
        (states, ends, torch.zeros(1, 4), valid, 4, "end_states"),
        (states, ends, torch.zeros(0, 4), valid[:1], 4, "valid"),
    ]
    for a, b, c, d, width, field in wrong:
        with pytest.raises(StyleError, match=f"^{field}: "):
            check_rollout(a, b, c, d, width)


def test_replay_keeps_all_until_full_then_a_share() -> None:
    memory = Replay(1000, 1, seed=0)
    rows = torch.arange(900.0).unsqueeze(1)
    assert memory.insert(rows, 0, 0.01) == 900
    assert memory.insert(rows[:200], 1, 0.0) == 100  # exactly what fits
    assert torch.equal(memory.rows[:, 0], torch.cat([torch.arange(900.0), torch.arange(100.0)]))
    new = torch.full((100_000, 1), -1.0)
    kept = memory.insert(new, 2, 0.002)
    assert 150 < kept < 250  # binomial: mean 200, deviation 14
    assert int((memory.rows == -1).sum()) == kept  # distinct slots


def test_inserting_a_batch_again_from_the_same_state_changes_nothing() -> None:
    memory = Replay(100, 1, seed=5)
    memory.insert(torch.zeros(100, 1), 0, 1.0)
    memory.insert(torch.arange(1.0, 1001.0).unsqueeze(1), 1, 0.05)
    once = memory.rows.clone()
    memory.insert(torch.arange(1.0, 1001.0).unsqueeze(1), 1, 0.05)
    assert torch.equal(memory.rows, once)
    assert memory.sample(7, np.random.default_rng(0)).shape == (7, 1)


def test_normaliser_is_fixed_floored_and_clipped() -> None:
    samples = torch.tensor([[1.0, 5.0], [3.0, 5.0]])
    mean, deviation = normaliser.fit(samples)
    assert mean.tolist() == [2.0, 5.0]
    assert deviation.tolist() == pytest.approx([1.0, 0.01])
    out = normaliser.normalise(torch.tensor([[2.5, 5.001], [-50.0, 9.0]]), mean, deviation)
    assert out.flatten().tolist() == pytest.approx([0.5, 0.1, -10.0, 10.0], abs=1e-4)
