"""Adapter of rsl_rl: its `OnPolicyRunner` on our scenes."""

# pyright: reportMissingImports=false

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch

from console.bench.peers import protocol, scenes
from console.bench.peers.protocol import Assignment, Iterate
from world.character.model import NU


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training by its runner."""
    from rsl_rl.env import VecEnv
    from rsl_rl.runners import OnPolicyRunner
    from tensordict import TensorDict

    ours = scenes.in_processes(assignment)

    class Environment(VecEnv):
        """Our scenes by its interface."""

        num_envs, num_actions, device, cfg = ours.n, NU, "cpu", {}
        max_episode_length = 1 << 30
        episode_length_buf = torch.zeros(ours.n, dtype=torch.long)

        def get_observations(self) -> Any:
            return TensorDict({"policy": ours.observation}, batch_size=[ours.n])

        def step(self, actions: torch.Tensor) -> Any:
            found = ours.step(actions)
            seen = TensorDict({"policy": found.observation}, batch_size=[ours.n])
            done = (found.terminated | found.truncated).long()
            return seen, found.reward, done, {"time_outs": found.truncated.float()}

    runner = OnPolicyRunner(Environment(), settings(assignment), log_dir=None, device="cpu")

    def iterate() -> int:
        runner.learn(1)
        return assignment.batch

    try:
        yield iterate
    finally:
        ours.close()


def settings(assignment: Assignment) -> dict[str, Any]:
    """Return the runner's settings with our network, batch and epochs."""
    ppo = assignment.experiment.ppo
    network = {
        "class_name": "MLPModel",
        "hidden_dims": list(ppo.hidden),
        "activation": "relu",
        "obs_normalization": True,
    }
    noise = {"class_name": "GaussianDistribution", "init_std": assignment.sigma}
    return {
        "num_steps_per_env": assignment.experiment.horizon,
        "save_interval": 1 << 30,
        "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
        "actor": network | {"distribution_cfg": noise},
        "critic": network,
        "algorithm": {
            "class_name": "PPO",
            "num_learning_epochs": ppo.epochs,
            "num_mini_batches": assignment.minibatches,
            "clip_param": ppo.clip[0][1],
            "gamma": ppo.gamma,
            "lam": ppo.lam,
            "learning_rate": ppo.actor_rate,
            "schedule": "fixed",
            "entropy_coef": 0.0,
            "max_grad_norm": ppo.actor_grad_norm,
            "use_mixed_precision": assignment.bf16,
        },
    }


if __name__ == "__main__":
    protocol.serve(open_peer)
