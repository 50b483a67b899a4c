"""Adam against torch's own, bit for bit; and what making one does not import."""

import subprocess
import sys

import torch
from torch import nn

from world.adam import Adam


def network() -> nn.Module:
    torch.manual_seed(3)
    return nn.Sequential(nn.Linear(19, 33), nn.ReLU(), nn.Linear(33, 5))


def descend(net: nn.Module, optimiser: Adam | torch.optim.Adam, steps: range) -> None:
    """Steps whose gradients differ by many orders of magnitude, and some parameter has none."""
    for k in steps:
        x = torch.randn(64, 19, generator=torch.Generator().manual_seed(k))
        optimiser.zero_grad()
        (10.0 ** (k % 7 - 3) * net(x).square().mean()).backward()
        if k == 2:
            next(iter(net.parameters())).grad = None
        optimiser.step()


def test_the_bits_of_torch_s_fused_adam() -> None:
    ours, theirs = network(), network()
    adam = Adam(ours.parameters(), 3e-3)
    oracle = torch.optim.Adam(theirs.parameters(), lr=3e-3, fused=True)
    descend(ours, adam, range(20))
    descend(theirs, oracle, range(20))
    adam.rate = oracle.param_groups[0]["lr"] = 1e-4
    descend(ours, adam, range(20, 40))
    descend(theirs, oracle, range(20, 40))
    for one, other in zip(ours.parameters(), theirs.parameters(), strict=True):
        assert torch.equal(one, other)
    moments = oracle.state_dict()["state"]
    assert adam.state_dict().keys() == {str(i) for i in moments}
    for index, entry in moments.items():
        assert entry.keys() == adam.state[str(index)].keys()
        assert all(torch.equal(v, adam.state[str(index)][k]) for k, v in entry.items())
    assert adam.steps_taken() == 40 and int(adam.state["0"]["step"]) == 39


def test_restored_it_goes_on_with_the_same_bits() -> None:
    whole, halves = network(), network()
    adam = Adam(whole.parameters(), 1e-2)
    assert adam.state_dict() == {} and adam.steps_taken() == 0
    descend(whole, adam, range(12))
    first = Adam(halves.parameters(), 1e-2)
    descend(halves, first, range(6))
    kept, second = first.state_dict(), Adam(halves.parameters(), 1e-2)
    second.load_state_dict(kept)
    descend(halves, second, range(6, 12))
    for one, other in zip(whole.parameters(), halves.parameters(), strict=True):
        assert torch.equal(one, other)
    assert int(kept["0"]["step"]) == 5, "what was kept is a copy"


def test_learning_imports_no_compiler() -> None:
    """Of torch's: a second of a core each time that something must be back soon."""
    code = (
        "import sys, torch; from tests.style_cases import SMALL, Mocap, rollout;"
        "from discriminator.trainer import Discriminator; from learner.config import LearnerConfig;"
        "from learner.ppo import Learner;"
        "Learner(20, 4, LearnerConfig(hidden=(16,))).close();"
        "style = Discriminator(SMALL, Mocap(), 0); style.score(0, **rollout(0)); style.train(0);"
        "sys.exit('torch._dynamo' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], timeout=300).returncode == 0
