"""Proximal policy optimisation (Schulman et al. 2017): the update of actor and critic."""

import copy
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace

import torch
from torch import Tensor, nn

from learner.config import LearnerConfig, piecewise
from learner.gradient_steps import (
    RAMP_STEPS,
    ActorStep,
    ActorSteps,
    Batch,
    CriticStep,
    Mirrored,
)
from learner.optimiser import adam, adam_state, load_adam_state, steps_taken
from learner.protocols import State
from learner.returns import advantages, explained_variance
from learner.surrogate import next_rate
from policy.model.acting import publish
from policy.model.networks import Actor, Critic
from policy.model.normaliser import Normaliser, NormaliserConfig, ValueNormaliser
from policy.rollout import Abandoned, Rollout, successors
from world.device import CPU, block_rows, moved, put
from world.graphs import forget, replayed
from world.precision import Precision, decide
from world.reflection import Symmetry

# Rows of one value inference: fixed, so that rounding does not depend on the number of threads.
VALUE_BLOCK = 1024

# Gate of the mirror loss, a sigmoid in the value difference between a state and its mirror image,
# in standard deviations of the returns: its centre and its width. Without a margin the loss draws a
# gait, and a turn at a seat that may go either way, to the middle between left and right:
# docs/lab-notes/sit.md has the figures.
MIRROR_MARGIN, MIRROR_WIDTH = 0.25, 0.08


class Learner:
    """Actor, critic, their normalisers and optimisers; a function of (seed, iteration)."""

    def __init__(
        self,
        observation: int,
        actions: int,
        config: LearnerConfig,
        seed: int = 0,
        precision: Precision | None = None,
        symmetry: Symmetry | None = None,
        device: torch.device = CPU,
        hidden: Tensor | None = None,
    ) -> None:
        """symmetry: mirror symmetry of observations and actions, for the mirror loss and for
        networks that act on one canonical side; None: neither.

        hidden: [d] bool: observations that the critic alone sees; None: none.
        """
        self._hidden = None if hidden is None or not hidden.any() else hidden.to(device)
        self.device = device
        self.symmetry = None if symmetry is None else moved(symmetry, device)
        # with a canonical side the networks are symmetric without a loss
        self._uses_mirror_loss = (
            config.mirror_weight and symmetry is not None and symmetry.sides is None
        )
        self.config = config
        self.seed = seed
        self.precision = precision or decide(device.type)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            # drawn on the CPU, so that a seed gives the same networks on every device
            self.actor = Actor(observation, actions, config.hidden, config.skip).to(device)
            self.critic = Critic(observation, config.hidden).to(device)
        #: Running mean of the actor over iterations, which evaluation and serving use.
        self.average = copy.deepcopy(self.actor).requires_grad_(False)
        limits = NormaliserConfig(config.observation_clip, config.observation_std_floor)
        self.normaliser = Normaliser(observation, limits)
        self.values = ValueNormaliser()
        self.normaliser.to(device)
        self.values.to(device)
        self.actor_optimiser = adam(self.actor.parameters(), config.actor_rate)
        self.critic_optimiser = adam(self.critic.parameters(), config.critic_rate)
        self.actor_rate = config.actor_rate
        #: Whether an update ends before its next gradient step, with Abandoned and a half-learned
        #: state.
        self.abandoned: Callable[[], bool] = lambda: False
        self.version = 0
        self.samples = 0
        self.stage_start = 0
        """Number of samples at the beginning of the stage, from which the schedules count."""
        self.warmup_left = config.warmup_iterations
        actor_step = ActorStep(self.actor, self.actor_optimiser, config, self.precision)
        critic_step = CriticStep(self.critic, self.critic_optimiser, config, self.precision)
        self._actor_step = replayed(actor_step, device, config.record)
        self._critic_step = replayed(critic_step, device, config.record)
        # a GPU has one queue
        threads = config.threads if device.type == "cpu" else 1
        self._pool = ThreadPoolExecutor(
            threads, "learner", initializer=torch.set_num_threads, initargs=(1,)
        )

    @property
    def sigma(self) -> float:
        """Standard deviation of the action noise of the next rollout."""
        return piecewise(self.config.sigma, self.stage_samples)

    @property
    def stage_samples(self) -> int:
        """Number of samples since the beginning of the stage."""
        return self.samples - self.stage_start

    @property
    def untaught(self) -> bool:
        """Whether the labels of a teacher have come to count nothing."""
        config = self.config
        return config.imitation_weight > 0.0 and config.imitation(self.stage_samples) == 0.0

    def weights(self) -> dict[str, Tensor]:
        """Weights for acting: the actor and the observation normaliser; on the CPU."""
        return _on_cpu(publish(self.actor, self.normaliser, self.symmetry, self._hidden))

    def averaged_weights(self) -> dict[str, Tensor]:
        """Weights for acting of the averaged actor; on the CPU."""
        return _on_cpu(publish(self.average, self.normaliser, self.symmetry, self._hidden))

    def update(self, rollout: Rollout, rewards: Tensor, sigma: float) -> dict[str, float]:
        """One PPO iteration on a rollout with mixed rewards [T, N]; returns `ppo/` metrics.

        Raises Abandoned where `abandoned` holds during it.
        """
        rollout = self._canonical_rollout(rollout.on(self.device))
        rewards = put(rewards, self.device)
        raw = torch.cat((rollout.states, rollout.goals), -1)
        observations = self.normaliser(raw)
        batch, explained = self._prepare(rollout, rewards, observations)
        symmetry = self.symmetry
        if symmetry is not None and self._uses_mirror_loss and not self.warmup_left:
            batch = replace(batch, mirrored=self._mirror(symmetry, rollout, raw, batch))
        critic = self._pool.submit(self._update_critic, batch)
        actor = self._pool.submit(self._update_actor, batch, sigma)
        metrics = {"ppo/value_explained": explained, "ppo/sigma": sigma}
        wait((critic, actor))
        metrics |= critic.result() | actor.result()
        self._update_average()
        # Only now: the likelihood ratios above are those of the normaliser that acted.
        self.update_normaliser(raw[:-1][rollout.valid])
        self.samples += rollout.samples
        self.version += 1
        self.warmup_left = max(0, self.warmup_left - 1)
        return metrics

    def canonical(self, raw: Tensor, *actions: Tensor) -> tuple[Tensor, ...]:
        """Observations [.., d] and their actions [.., 28] on the canonical side of the symmetry."""
        if self.symmetry is None:
            return raw, *actions
        raw, right = self.symmetry.canonical(raw)
        return raw, *(self.symmetry.restored(action, right) for action in actions)

    def _canonical_rollout(self, rollout: Rollout) -> Rollout:
        """The rollout on the canonical side; log-densities stay, because all actions have one
        sigma."""
        if self.symmetry is None or self.symmetry.sides is None:
            return rollout
        widths = [rollout.states.shape[-1], rollout.goals.shape[-1]]
        raw = torch.cat((rollout.states, rollout.goals), -1)
        (last,) = self.canonical(raw[-1:])
        labels = () if rollout.teacher_action is None else (rollout.teacher_action,)
        first, actions, means, *labels = self.canonical(
            raw[:-1], rollout.actions, rollout.means, *labels
        )
        states, goals = torch.cat((first, last)).split(widths, -1)
        (ends,) = self.canonical(torch.cat((rollout.end_states, rollout.end_goals), -1))
        end_states, end_goals = ends.split(widths, -1)
        return replace(
            rollout,
            states=states,
            goals=goals,
            actions=actions,
            means=means,
            end_states=end_states,
            end_goals=end_goals,
            teacher_action=labels[0] if labels else None,
        )

    def _prepare(
        self, rollout: Rollout, rewards: Tensor, observations: Tensor
    ) -> tuple[Batch, float]:
        """Batch of the valid samples, and the fraction of the returns' variance that is
        explained."""
        ends = self.normaliser(torch.cat((rollout.end_states, rollout.end_goals), -1))
        values = self._infer_values(observations)
        next_values = successors(values, rollout.end_index, self._infer_values(ends))
        gains = advantages(
            rewards,
            values[:-1],
            next_values,
            rollout.fell,
            rollout.timed_out,
            rollout.valid,
            self.config.gamma,
            self.config.lam,
        )
        valid = rollout.valid
        gain, value = gains[valid], values[:-1][valid]
        returns = gain + value
        self._update_values(returns)
        spread = gain.std() if gain.numel() > 1 else gain.new_ones(())
        labels = rollout.teacher_action
        seen = observations[:-1][valid]
        batch = Batch(
            observations=seen,
            seen=seen if self._hidden is None else seen.masked_fill(self._hidden, 0.0),
            actions=rollout.actions[valid],
            means=rollout.means[valid],
            log_probs=rollout.log_probs[valid],
            advantages=(gain - gain.mean()) / (spread + 1e-8),
            targets=self.values.normalise(returns),
            teacher_action=None if labels is None else labels[valid],
        )
        return batch, explained_variance(value, returns)

    def _mirror(self, symmetry: Symmetry, rollout: Rollout, raw: Tensor, batch: Batch) -> Mirrored:
        """Mirror images of a batch; raw: observations [T+1, N, d] before normalisation."""
        images = self.normaliser(symmetry.observation(raw[:-1][rollout.valid]))
        shown = images if self._hidden is None else images.masked_fill(self._hidden, 0.0)
        better = self._infer_values(batch.observations) - self._infer_values(images)
        gates = torch.sigmoid((better / self.values.std - MIRROR_MARGIN) / MIRROR_WIDTH)
        return Mirrored(shown, symmetry.action(batch.means), gates)

    def _infer_values(self, observations: Tensor) -> Tensor:
        """Values [..] of normalised observations [.., d], in fixed blocks over the threads."""

        def block(rows: Tensor) -> Tensor:
            self._go_on()
            with torch.no_grad(), self.precision.context():
                return self.critic(rows)

        flat = observations.reshape(-1, observations.shape[-1])
        rows = block_rows(VALUE_BLOCK, self.device)
        blocks = list(self._pool.map(block, flat.split(rows)))
        values = torch.cat(blocks) if blocks else flat.new_zeros(0)
        return self.values.denormalise(values.reshape(observations.shape[:-1]))

    @torch.no_grad()
    def _update_values(self, returns: Tensor) -> None:
        """Merge returns into their normaliser, keeping the critic's predictions.

        PopArt, van Hasselt et al. 2016.
        """
        fresh, mean, std = self.values.fresh, self.values.mean, self.values.std
        self.values.update(returns)
        if fresh:
            return
        head = self.critic.head
        head.weight.mul_(std / self.values.std)
        head.bias.mul_(std).add_(mean - self.values.mean).div_(self.values.std)

    @torch.no_grad()
    def update_normaliser(self, rows: Tensor) -> None:
        """Merge observations into their normaliser, keeping the networks' outputs.

        Early moments, or those of another task, move by whole deviations as the scenes change.
        Without this correction a walking policy lost its gait in a carry training whose updates did
        not touch it (docs/lab-notes/physics-and-cost.md).
        """
        normaliser = self.normaliser
        mean, std, known = normaliser.mean.float(), normaliser.std, normaliser.count > 0.0
        normaliser.update(rows)
        scale = normaliser.std / std
        shift = (normaliser.mean.float() - mean) / std
        # a feature that was nearly constant had no influence yet: its weights stay
        known &= (scale > 0.5) & (scale < 2.0)
        scale, shift = torch.where(known, scale, 1.0), torch.where(known, shift, 0.0)
        # an actor never reads what is hidden from it, whose moments must not move its bias
        own = shift if self._hidden is None else shift.masked_fill(self._hidden, 0.0)
        for network, moved_by in ((self.actor, own), (self.average, own), (self.critic, shift)):
            first = network.layers[0]
            assert isinstance(first, nn.Linear)
            first.bias.add_(first.weight @ moved_by)
            first.weight.mul_(scale)
        for actor in (self.actor, self.average):
            if actor.skip is not None:
                actor.head.bias.add_(actor.skip.weight @ own)
                actor.skip.weight.mul_(scale)

    @torch.no_grad()
    def _update_average(self) -> None:
        """Polyak averaging of the actor; during warm-up the average equals the actor."""
        fraction = 1.0 if self.warmup_left else 1.0 - self.config.average
        for mean, now in zip(self.average.parameters(), self.actor.parameters(), strict=True):
            mean.lerp_(now, fraction)

    def _minibatches(self, samples: int, part: int) -> list[list[Tensor]]:
        """Indices by epoch and minibatch, from (seed, version); part: 0 critic, 1 actor."""
        seed = (self.seed * 2 + part) * 1_000_003 + self.version
        generator = torch.Generator().manual_seed(seed % 2**63)  # more bits are refused
        parts = max(1, round(samples / self.config.minibatch))
        return [
            list(put(torch.randperm(samples, generator=generator), self.device).tensor_split(parts))
            for _ in range(self.config.epochs)
        ]

    def _go_on(self) -> None:
        """Raise Abandoned where the update is to end."""
        if self.abandoned():
            raise Abandoned

    def _going_on(self, parts: list[Tensor]) -> Iterator[Tensor]:
        """The parts, as long as the update is not to end."""
        for part in parts:
            self._go_on()
            yield part

    def _update_critic(self, batch: Batch) -> dict[str, float]:
        began = time.perf_counter()
        losses = [
            self._critic_step(batch.observations[rows], batch.targets[rows])
            for epoch in self._minibatches(len(batch.targets), 0)
            for rows in self._going_on(epoch)
        ]
        return {
            "ppo/value_loss": float(torch.stack(losses).double().mean()),
            "rate/critic_s": time.perf_counter() - began,
        }

    def _update_actor(self, batch: Batch, sigma: float) -> dict[str, float]:
        """The epochs of the actor; nothing is read from the device before they are all queued."""
        began = time.perf_counter()
        config = self.config
        target = piecewise(config.kl_target, self.stage_samples)
        clip = piecewise(config.clip, self.stage_samples)
        drawn = config.imitation(self.stage_samples)
        numbers = [sigma, clip, config.kl_skip * target, self.actor_rate, drawn]
        settings = put(torch.tensor(numbers, dtype=torch.float64), self.device)
        epochs = [] if self.warmup_left else self._minibatches(len(batch.targets), 1)
        queued = [
            self._actor_step(settings, *batch.rows(rows))
            for epoch in epochs
            for rows in self._going_on(epoch)
        ]
        found = ActorSteps(queued)
        kl = found.kl(len(epochs[-1])) if epochs else 0.0
        if epochs:
            rate = next_rate(self.actor_rate, kl, target, config.actor_rate_bounds)
            rising = steps_taken(self.actor_optimiser) < RAMP_STEPS
            self.actor_rate = min(rate, self.actor_rate) if rising else rate
        return {
            "ppo/kl": kl,
            "ppo/clip_fraction": found.mean("clipped"),
            "ppo/learning_rate": self.actor_rate,
            "ppo/surrogate": found.mean("surrogate"),
            "ppo/bound": found.mean("bound"),
            **({"ppo/mirror": found.mean("mirror")} if batch.mirrored else {}),
            **(
                {"ppo/imitation": found.mean("imitation")}
                if batch.teacher_action is not None
                else {}
            ),
            "ppo/skipped": float(found.skipped),
            "rate/actor_s": time.perf_counter() - began,
        }

    def policy_state(self) -> State:
        """Networks and normalisers, for acting, serving and `--init`."""
        return {
            "actor": {k: v.clone() for k, v in self.actor.state_dict().items()},
            "average": {k: v.clone() for k, v in self.average.state_dict().items()},
            "critic": {k: v.clone() for k, v in self.critic.state_dict().items()},
            "normaliser": self.normaliser.state_dict(),
            "values": self.values.state_dict(),
        }

    def load_policy_state(self, state: State) -> None:
        """Load networks and normalisers; optimisers and counters stay."""
        self.actor.load_state_dict(state["actor"])
        # absent in checkpoints of runs without averaging
        self.average.load_state_dict(state.get("average", state["actor"]))
        self.critic.load_state_dict(state["critic"])
        self.normaliser.load_state_dict(state["normaliser"])
        self.values.load_state_dict(state["values"])

    def state_dict(self) -> State:
        """Optimisers and counters: what an exact restart needs beyond `policy_state`."""
        return {
            "actor_optimiser": adam_state(self.actor_optimiser),
            "critic_optimiser": adam_state(self.critic_optimiser),
            "actor_rate": self.actor_rate,
            "version": self.version,
            "samples": self.samples,
            "stage_start": self.stage_start,
            "warmup_left": self.warmup_left,
        }

    def load_state_dict(self, state: State) -> None:
        """Restore a `state_dict`."""
        load_adam_state(self.actor_optimiser, state["actor_optimiser"])
        load_adam_state(self.critic_optimiser, state["critic_optimiser"])
        forget(self._actor_step)
        forget(self._critic_step)
        self.go_on_from(state)
        self.stage_start = int(state.get("stage_start", 0))  # older runs had no stages
        self.warmup_left = int(state["warmup_left"])

    def go_on_from(self, state: State) -> None:
        """Continue the counts of updates and samples, and the actor's learning rate, of another
        learner's `state_dict`."""
        self.actor_rate = float(state["actor_rate"])
        self.version = int(state["version"])
        self.samples = int(state["samples"])

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()


def _on_cpu(weights: dict[str, Tensor]) -> dict[str, Tensor]:
    return {name: tensor.to(CPU) for name, tensor in weights.items()}
