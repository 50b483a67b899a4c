"""Adapter of skrl: its `PPO` agent and `StepTrainer` on our scenes."""

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
    """Open a training by its step trainer."""
    import gymnasium
    from skrl.agents.torch.ppo import PPO
    from skrl.envs.wrappers.torch import Wrapper
    from skrl.memories.torch import RandomMemory
    from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
    from skrl.resources.preprocessors.torch import RunningStandardScaler
    from skrl.trainers.torch import StepTrainer

    experiment = assignment.experiment
    hidden = experiment.ppo.hidden
    ours = scenes.in_processes(assignment)
    wide = scenes.width(experiment)
    seen = gymnasium.spaces.Box(-math.inf, math.inf, (wide,))
    acted = gymnasium.spaces.Box(-math.inf, math.inf, (NU,))

    class Environment(Wrapper):
        """Our scenes by its interface."""

        num_envs, num_agents, device = ours.n, 1, torch.device("cpu")
        observation_space, action_space, state_space = seen, acted, None

        def reset(self) -> Any:
            return ours.observation, {}

        def step(self, actions: torch.Tensor) -> Any:
            found = ours.step(actions)
            ends = found.terminated[:, None], found.truncated[:, None]
            return found.observation, found.reward[:, None], *ends, {}

        def state(self) -> None:
            return None

        def render(self) -> None:
            return None

        def close(self) -> None:
            return None

    class Actor(GaussianMixin, Model):
        """Our network with a learned deviation, as its Gaussian models have."""

        def __init__(self) -> None:
            Model.__init__(self, observation_space=seen, action_space=acted, device="cpu")
            GaussianMixin.__init__(self)
            self.layers = perceptron(wide, hidden, NU, ACTOR_OUTPUT_GAIN)
            self.log_std = nn.Parameter(torch.full((NU,), math.log(assignment.sigma)))

        def compute(self, inputs: Any, role: str = "") -> Any:
            return self.layers(inputs["observations"]), {"log_std": self.log_std}

    class Critic(DeterministicMixin, Model):
        """Our network."""

        def __init__(self) -> None:
            Model.__init__(self, observation_space=seen, action_space=acted, device="cpu")
            DeterministicMixin.__init__(self)
            self.layers = perceptron(wide, hidden, 1, 1.0)

        def compute(self, inputs: Any, role: str = "") -> Any:
            return self.layers(inputs["observations"]), {}

    environment = Environment(ours)
    agent = PPO(
        models={"policy": Actor(), "value": Critic()},
        memory=RandomMemory(memory_size=experiment.horizon, num_envs=ours.n, device="cpu"),
        observation_space=seen,
        action_space=acted,
        device="cpu",
        cfg=settings(assignment)
        | {
            "observation_preprocessor": RunningStandardScaler,
            "observation_preprocessor_kwargs": {"size": seen, "device": "cpu"},
            "value_preprocessor": RunningStandardScaler,
            "value_preprocessor_kwargs": {"size": 1, "device": "cpu"},
        },
    )
    endless = {"timesteps": 1 << 30, "headless": True, "disable_progressbar": True}
    trainer = StepTrainer(env=environment, agents=agent, cfg=endless)

    def iterate() -> int:
        for _ in range(experiment.horizon):
            trainer.train()
        return assignment.batch

    try:
        yield iterate
    finally:
        ours.close()


def settings(assignment: Assignment) -> dict[str, Any]:
    """Return the agent's settings with our batch and epochs."""
    ppo = assignment.experiment.ppo
    return {
        "rollouts": assignment.experiment.horizon,
        "learning_epochs": ppo.epochs,
        "mini_batches": assignment.minibatches,
        "discount_factor": ppo.gamma,
        "gae_lambda": ppo.lam,
        "learning_rate": ppo.actor_rate,
        "grad_norm_clip": ppo.actor_grad_norm,
        "ratio_clip": ppo.clip[0][1],
        "time_limit_bootstrap": True,
        "mixed_precision": assignment.bf16,
        "experiment": {"write_interval": 0, "checkpoint_interval": 0},
    }


if __name__ == "__main__":
    protocol.serve(open_peer)
