"""Adapter of RLlib: its `PPO` with CPU environment runners, each with a shard of our scenes."""

# pyright: reportMissingImports=false

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from console.bench.peers import protocol, scenes
from console.bench.peers.protocol import Assignment, Iterate
from world.character.model import NU

NAME = "inhabit"


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training by its algorithm, on a Ray of its own."""
    # Ray gives its workers a lower priority, which on a shared machine is another's measurement.
    os.environ["RAY_worker_niceness"] = "0"  # noqa: SIM112
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
    from ray.tune.registry import register_env

    from actors.cluster import ray_session

    experiment, ppo = assignment.experiment, assignment.experiment.ppo
    workers = assignment.threads
    network = DefaultModelConfig(
        fcnet_hiddens=list(ppo.hidden),
        fcnet_activation="relu",
        vf_share_layers=False,
        free_log_std=True,
        log_std_clip_param=20.0,
    )
    each = experiment.scenes // workers
    register_env(NAME, _environment(assignment, each))
    config = (
        PPOConfig()
        .environment(NAME)
        .env_runners(
            num_env_runners=workers,
            num_envs_per_env_runner=each,
            rollout_fragment_length=experiment.horizon,
            gym_env_vectorize_mode="vector_entry_point",
        )
        .learners(num_learners=0)
        .rl_module(model_config=network)
        .training(
            train_batch_size_per_learner=assignment.batch,
            minibatch_size=assignment.batch // assignment.minibatches,
            num_epochs=ppo.epochs,
            gamma=ppo.gamma,
            lambda_=ppo.lam,
            lr=ppo.actor_rate,
            clip_param=ppo.clip[0][1],
            grad_clip=ppo.actor_grad_norm,
            use_kl_loss=False,
            vf_clip_param=math.inf,
        )
        .debugging(seed=experiment.seed)
        .reporting(min_time_s_per_iteration=None, min_sample_timesteps_per_iteration=0)
    )
    with ray_session(workers + 1):
        algorithm = config.build_algo()
        _begin_noise(algorithm, math.log(assignment.sigma))

        def iterate() -> int:
            before = _sampled(algorithm)
            algorithm.train()
            return _sampled(algorithm) - before

        try:
            yield iterate
        finally:
            algorithm.stop()


def _begin_noise(algorithm: Any, log_std: float) -> None:
    """Let the learned deviation begin at this logarithm; its networks have no setting for it."""
    import torch
    from ray.rllib.core import DEFAULT_MODULE_ID

    def begin(learner: Any) -> None:
        with torch.no_grad():
            learner.module[DEFAULT_MODULE_ID].pi.log_std.fill_(log_std)

    algorithm.learner_group.foreach_learner(begin)
    algorithm.env_runner_group.sync_weights(
        from_worker_or_learner_group=algorithm.learner_group, inference_only=True
    )


def _sampled(algorithm: Any) -> int:
    """Return the number of control steps that an algorithm has sampled."""
    return int(algorithm.metrics.peek(("env_runners", "num_env_steps_sampled_lifetime"), default=0))


def _environment(assignment: Assignment, each: int) -> Any:
    """Return the factory of a runner's vectorised environment of `each` scenes."""
    import gymnasium
    import torch
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

    experiment = assignment.experiment
    seen = gymnasium.spaces.Box(-math.inf, math.inf, (scenes.width(experiment),))
    acted = gymnasium.spaces.Box(-math.inf, math.inf, (NU,))

    class Environment(VectorEnv):
        """Our scenes by gymnasium's interface."""

        metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012
        num_envs = each
        single_observation_space, single_action_space = seen, acted
        observation_space, action_space = batch_space(seen, each), batch_space(acted, each)

        _ours: scenes.NextStep | None = None

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            if self._ours is None:
                torch.set_num_threads(1)
                # runners count from 1, and add their number to the experiment's seed: each has
                # scenes of its own
                first = each * (seed - experiment.seed - 1)
                made = scenes.factory(assignment)(range(first, first + each))
                self._ours = scenes.NextStep(scenes.ShardScenes(made))
            return self._ours.reset(), {}

        def step(self, actions: Any) -> Any:
            assert self._ours is not None
            return *self._ours.step(actions), {}

    def make(_context: Any) -> Any:
        return Environment()

    return make


if __name__ == "__main__":
    protocol.serve(open_peer)
