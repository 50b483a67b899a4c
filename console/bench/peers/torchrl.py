"""Adapter of TorchRL: its collector, `GAE` and `ClipPPOLoss` on our scenes.

TorchRL gives the parts of a loop: this one is that of its PPO tutorial, but with advantages once an
iteration, as the others compute them, not once an epoch.
"""

# pyright: reportMissingImports=false

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from torch import nn

from console.bench.peers import protocol, scenes
from console.bench.peers.protocol import Assignment, Iterate
from policy.model.networks import ACTOR_OUTPUT_GAIN, perceptron
from world.character.model import NU


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training of its parts."""
    from tensordict import TensorDict
    from tensordict.nn import AddStateIndependentNormalScale, TensorDictModule
    from torchrl.collectors import Collector
    from torchrl.data import Composite, Unbounded
    from torchrl.envs import EnvBase, TransformedEnv
    from torchrl.envs.transforms import VecNormV2
    from torchrl.modules import IndependentNormal, ProbabilisticActor, ValueOperator
    from torchrl.objectives import ClipPPOLoss
    from torchrl.objectives.value import GAE

    experiment, ppo = assignment.experiment, assignment.experiment.ppo
    ours = scenes.in_processes(assignment)
    wide = scenes.width(experiment)

    class Environment(EnvBase):
        """Our scenes by its interface; it resets scenes on request."""

        def __init__(self) -> None:
            super().__init__(device="cpu", batch_size=[ours.n])
            flag = Unbounded((ours.n, 1), dtype=torch.bool)
            self.observation_spec = Composite(observation=Unbounded((ours.n, wide)), shape=[ours.n])
            self.action_spec = Unbounded((ours.n, NU))
            self.reward_spec = Unbounded((ours.n, 1))
            self.done_spec = Composite(
                done=flag, terminated=flag.clone(), truncated=flag.clone(), shape=[ours.n]
            )

        def _reset(self, tensordict: Any, **_: Any) -> Any:
            return TensorDict({"observation": ours.observation}, batch_size=[ours.n])

        def _step(self, tensordict: Any) -> Any:
            found = ours.step(tensordict["action"])
            ended, cut = found.terminated[:, None], found.truncated[:, None]
            ends = {"terminated": ended, "truncated": cut, "done": ended | cut}
            seen = {"observation": found.successor, "reward": found.reward[:, None]}
            return TensorDict(seen | ends, batch_size=[ours.n])

        def _set_seed(self, seed: int | None) -> None:
            return None

    noise = AddStateIndependentNormalScale(NU, scale_mapping="exp")
    nn.init.constant_(noise.state_independent_scale, math.log(assignment.sigma))
    layers = nn.Sequential(perceptron(wide, ppo.hidden, NU, ACTOR_OUTPUT_GAIN), noise)
    actor = ProbabilisticActor(
        TensorDictModule(layers, in_keys=["observation"], out_keys=["loc", "scale"]),
        in_keys=["loc", "scale"],
        distribution_class=IndependentNormal,
        return_log_prob=True,
    )
    critic = ValueOperator(perceptron(wide, ppo.hidden, 1, 1.0), in_keys=["observation"])
    gains = GAE(gamma=ppo.gamma, lmbda=ppo.lam, value_network=critic, average_gae=True)
    loss = ClipPPOLoss(
        actor, critic, clip_epsilon=ppo.clip[0][1], entropy_bonus=False, loss_critic_type="l2"
    )
    optimiser = torch.optim.Adam(loss.parameters(), lr=ppo.actor_rate)
    collector = Collector(
        TransformedEnv(Environment(), VecNormV2(in_keys=["observation"])),
        actor,
        frames_per_batch=assignment.batch,
        total_frames=-1,
        trust_policy=True,
    )
    rollouts = iter(collector)

    def iterate() -> int:
        rollout = next(rollouts)
        with torch.no_grad():
            samples = gains(rollout).reshape(-1)
        for _ in range(ppo.epochs):
            for rows in torch.randperm(assignment.batch).tensor_split(assignment.minibatches):
                with torch.autocast("cpu", torch.bfloat16, enabled=assignment.bf16):
                    found = loss(samples[rows])
                    whole = found["loss_objective"] + found["loss_critic"]
                optimiser.zero_grad()
                whole.backward()
                nn.utils.clip_grad_norm_(loss.parameters(), ppo.actor_grad_norm)
                optimiser.step()
        return assignment.batch

    try:
        yield iterate
    finally:
        collector.shutdown()
        ours.close()


if __name__ == "__main__":
    protocol.serve(open_peer)
