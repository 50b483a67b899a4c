"""Published weights act as the learner's network, on both sides of the mirror."""

import torch

from policy.model.acting import Policy, publish
from policy.model.networks import Actor
from policy.model.normaliser import Normaliser
from world import tasks
from world.character.features import STATE
from world.tasks.symmetry import symmetry


def test_published_policy_acts_as_the_learners_network():
    torch.manual_seed(2)
    actor, normaliser = Actor(6, 2, (8, 4)), Normaliser(6)
    normaliser.update(torch.randn(100, 6) * 3 + 1)
    policy = Policy(publish(actor, normaliser))
    state, goal = torch.randn(5, 4), torch.randn(5, 2)
    expected = actor(normaliser(torch.cat((state, goal), 1))).detach()
    assert torch.equal(policy(state, goal), expected)
    assert policy.actions == 2


def one_sided() -> tuple[Policy, Policy]:
    """A policy of lie, that knows one side alone, and the same weights without that."""
    torch.manual_seed(4)
    width = STATE.width + tasks.make("lie").goal.width
    actor, normaliser = Actor(width, 28, (8, 4)), Normaliser(width)
    torch.nn.init.normal_(actor.layers[-1].weight, std=0.3)
    normaliser.update(torch.randn(100, width) * 3 + 1)
    sides = symmetry(tasks.make("lie"))
    return Policy(publish(actor, normaliser, sides)), Policy(publish(actor, normaliser))


def test_what_lies_to_the_right_is_done_in_the_mirror():
    policy, plain = one_sided()
    sides, goal = symmetry(tasks.make("lie")), tasks.make("lie").goal
    x = torch.randn(64, STATE.width + goal.width)
    facing, head = (x[:, STATE.width :][:, goal.slice(f)] for f in ("facing", "head"))
    to_left = facing[:, 0] * head[:, 1] - facing[:, 1] * head[:, 0] > 0.0
    assert 16 < int(to_left.sum()) < 48

    def act(with_: Policy, rows: torch.Tensor) -> torch.Tensor:
        return with_(rows[:, : STATE.width], rows[:, STATE.width :])

    images, action = sides.observation(x), act(policy, x)
    # the mirrored observation calls for the mirrored action, to the last bit
    assert torch.equal(act(policy, images), sides.action(action))
    assert torch.equal(action[to_left], act(plain, x)[to_left])
    assert torch.equal(action[~to_left], sides.action(act(plain, images))[~to_left])
    assert (action - act(plain, x))[~to_left].abs().max() > 0.1


def test_published_weights_do_not_follow_the_learner():
    actor, normaliser = Actor(6, 2, (8,)), Normaliser(6)
    weights = publish(actor, normaliser)
    before = weights["actor.layers.0.weight"].clone()
    with torch.no_grad():
        actor.layers[0].weight.add_(1.0)
    assert torch.equal(weights["actor.layers.0.weight"], before)
