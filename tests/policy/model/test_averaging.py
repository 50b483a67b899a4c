"""The mean of checkpoints: the same function under moving normalisers, and a mean of weights."""

import pytest
import torch

from policy.errors import CheckpointError
from policy.model.averaging import mean_policy
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser, NormaliserConfig

LIMITS = NormaliserConfig(clip=50.0)


def section(actor: Actor, rows: torch.Tensor) -> dict[str, dict[str, torch.Tensor]]:
    """As a checkpoint's: the actor, and a normaliser that has seen `rows` [n, 3]."""
    normaliser = Normaliser(3, LIMITS)
    normaliser.update(rows)
    state = {name: value.clone() for name, value in actor.state_dict().items()}
    return {"actor": state, "average": state, "normaliser": normaliser.state_dict()}


def act(policy: dict[str, dict[str, torch.Tensor]], rows: torch.Tensor) -> torch.Tensor:
    actor, normaliser = Actor(3, 2, (5, 4)), Normaliser(3, LIMITS)
    actor.load_state_dict(policy["average"])
    normaliser.load_state_dict(policy["normaliser"])
    with torch.no_grad():
        return actor(normaliser(rows))


def test_a_function_stays_itself_under_another_normaliser() -> None:
    """f(x) under N(0, 1) and f written by hand for N(3, 2) average to f."""
    torch.manual_seed(0)
    rows = torch.randn(4000, 3)
    actor = Actor(3, 2, (5, 4))
    first = section(actor, rows)
    moved = Actor(3, 2, (5, 4))
    moved.load_state_dict(actor.state_dict())
    second = section(moved, 2.0 * rows + 3.0)
    before, after = first["normaliser"], second["normaliser"]
    old, new = before["variance"].sqrt(), after["variance"].sqrt()
    with torch.no_grad():
        own = first["average"]
        weight = second["average"]["layers.0.weight"] = own["layers.0.weight"] * (new / old).float()
        shift = ((after["mean"] - before["mean"]) / new).float()
        second["average"]["layers.0.bias"] = own["layers.0.bias"] + weight @ shift
    x = torch.randn(50, 3)
    torch.testing.assert_close(act(second, x), act(first, x), atol=1e-5, rtol=1e-5)
    both = mean_policy([first, second], LIMITS)
    torch.testing.assert_close(act(both, x), act(first, x), atol=1e-5, rtol=1e-5)
    assert both["normaliser"] is second["normaliser"]


def test_what_is_hidden_from_the_actor_does_not_move_its_biases() -> None:
    """The critic's observations are 0 to the actor under any normaliser."""
    torch.manual_seed(3)
    rows, hidden = torch.randn(4000, 3), torch.tensor([False, True, False])
    actor = Actor(3, 2, (5, 4), skip=True)
    assert actor.skip is not None
    torch.nn.init.normal_(actor.skip.weight)
    first = section(actor, rows)
    second = section(actor, rows + torch.tensor([0.0, 3.0, 0.0]))
    mean = mean_policy([first, second], LIMITS, hidden)

    def seen(policy: dict[str, dict[str, torch.Tensor]]) -> torch.Tensor:
        found, normaliser = Actor(3, 2, (5, 4), skip=True), Normaliser(3, LIMITS)
        found.load_state_dict(policy["average"])
        normaliser.load_state_dict(policy["normaliser"])
        with torch.no_grad():
            return found(normaliser(rows[:50]).masked_fill(hidden, 0.0))

    torch.testing.assert_close(seen(mean), seen(first), atol=1e-4, rtol=1e-4)
    wrong = mean_policy([first, second], LIMITS)
    assert float((seen(wrong) - seen(first)).abs().max()) > 0.1


def test_so_does_what_skips_the_layers() -> None:
    torch.manual_seed(2)
    rows = torch.randn(4000, 3)
    actor = Actor(3, 2, (5, 4), skip=True)
    assert actor.skip is not None
    torch.nn.init.normal_(actor.skip.weight)
    first, second = section(actor, rows), section(actor, 2.0 * rows + 3.0)
    mean = mean_policy([first, second], LIMITS)["average"]
    x, old, new = torch.randn(50, 3), Normaliser(3, LIMITS), Normaliser(3, LIMITS)
    old.load_state_dict(first["normaliser"])
    new.load_state_dict(second["normaliser"])
    moved = mean["skip.weight"] @ new(x).T + mean["layers.4.bias"][:, None]
    head = actor.head.bias[:, None]
    expected = actor.skip.weight @ (0.5 * old(x) + 0.5 * new(x)).T + head
    torch.testing.assert_close(moved, expected, atol=1e-5, rtol=1e-5)


def test_weights_are_averaged_where_the_normaliser_stands_still() -> None:
    torch.manual_seed(1)
    rows = torch.randn(100, 3)
    three = [section(Actor(3, 2, (5, 4)), rows) for _ in range(3)]
    mean = mean_policy(three, LIMITS)
    for name, value in mean["average"].items():
        expected = sum(one["average"][name] for one in three) / 3
        torch.testing.assert_close(value, expected, atol=1e-6, rtol=1e-6)
    assert mean["actor"] is three[-1]["actor"]


def test_other_shapes_and_nothing_are_refused() -> None:
    rows = torch.randn(10, 3)
    with pytest.raises(CheckpointError, match="different shapes"):
        mean_policy(
            [section(Actor(3, 2, (5, 4)), rows), section(Actor(3, 2, (5, 3)), rows)], LIMITS
        )
    with pytest.raises(CheckpointError, match="no checkpoints"):
        mean_policy([], LIMITS)
