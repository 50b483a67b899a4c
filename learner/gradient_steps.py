"""Gradient steps of actor and critic, as functions of tensors alone: a GPU can replay them.

Neither reads a number from the device: what differs between steps is a tensor (world.graphs).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from learner.config import LearnerConfig
from learner.optimiser import descend, set_rate, step_count
from learner.surrogate import (
    clipped_surrogate,
    imitation_loss,
    kl_fixed_sigma,
    mirror_loss,
    soft_bound,
)
from policy.model.networks import Actor, Critic, log_density
from world.precision import Precision

# Gradient steps over which the actor's learning rate rises to its value. Adam's first steps move
# every weight by the full rate: measured on a cloned actor, four of them gave a KL of 0.4.
RAMP_STEPS = 40

#: What a gradient step of the actor returns.
NUMBERS: tuple[str, ...] = (
    "kl",
    "skipped",
    "surrogate",
    "bound",
    "mirror",
    "imitation",
    "clipped",
)


@dataclass(frozen=True)
class Batch:
    """The valid samples of one iteration, flat [n, ..]; observations are normalised."""

    observations: Tensor
    seen: Tensor
    """Observations of the actor: 0 where the critic alone sees them"""
    actions: Tensor
    means: Tensor
    log_probs: Tensor
    advantages: Tensor
    targets: Tensor
    mirrored: "Mirrored | None" = None
    teacher_action: Tensor | None = None
    """NaN where the teacher labels nothing"""

    def rows(self, rows: Tensor) -> tuple[Tensor | None, ...]:
        """What a gradient step of the actor takes of a minibatch; of mirror images every other
        row."""
        labels, image = self.teacher_action, self.mirrored
        images: tuple[Tensor | None, ...] = (None, None, None)
        if image is not None:
            some = rows[::2]
            images = image.observations[some], image.means[some], image.gates[some]
        return (
            self.seen[rows],
            self.actions[rows],
            self.means[rows],
            self.log_probs[rows],
            self.advantages[rows],
            None if labels is None else labels[rows],
            *images,
        )


@dataclass(frozen=True)
class Mirrored:
    """Mirror images of the samples of a batch, [n, ..]."""

    observations: Tensor
    """Normalised; of the actor"""
    means: Tensor
    """Mirror images of the acting policy's means"""
    gates: Tensor
    """In (0, 1): near 1 where the critic values the sample much more than its image"""


@dataclass(frozen=True)
class CriticStep:
    """One gradient step of the critic."""

    critic: Critic
    optimiser: torch.optim.Optimizer
    config: LearnerConfig
    precision: Precision

    def __call__(self, observations: Tensor, targets: Tensor) -> Tensor:
        """Take it on rows [m, ..]; the loss []."""
        with self.precision.context():
            values = self.critic(observations)
        loss = (values - targets).square().mean()
        descend(self.critic, self.optimiser, loss, self.config.critic_grad_norm)
        return loss.detach()


@dataclass(frozen=True)
class ActorStep:
    """One gradient step of the actor."""

    actor: Actor
    optimiser: torch.optim.Optimizer
    config: LearnerConfig
    precision: Precision

    def __call__(
        self,
        settings: Tensor,
        observations: Tensor,
        actions: Tensor,
        old_means: Tensor,
        log_probs: Tensor,
        gains: Tensor,
        teacher_action: Tensor | None,
        images: Tensor | None,
        image_means: Tensor | None,
        gates: Tensor | None,
    ) -> Tensor:
        """Take it on rows [m, ..] (Batch.rows); NUMBERS [7] float64.

        settings: [5] float64: sigma, clip range, the KL beyond which the weights stay, learning
        rate, weight of the imitation. Mirror images are of every other row, which halves their
        cost.
        """
        config = self.config
        sigma, clip, limit, rate, drawn = settings.unbind()
        with self.precision.context():
            means = self.actor(observations)
        kl = kl_fixed_sigma(means.detach(), old_means, sigma)
        log_ratio = log_density(actions, means, sigma) - log_probs
        surrogate = clipped_surrogate(log_ratio, gains, clip)
        bound = soft_bound(means)
        imitation = mirror = means.new_zeros(())
        if teacher_action is not None:
            imitation = imitation_loss(means, teacher_action, sigma)
        if images is not None and image_means is not None and gates is not None:
            with self.precision.context():
                seen = self.actor(images)
            mirror = mirror_loss(seen, image_means, gates, sigma)
        ramp = ((step_count(self.optimiser) + 1.0) / RAMP_STEPS).clamp(max=1.0)
        set_rate(self.optimiser, ramp * rate)
        far = kl > limit
        loss = (
            surrogate
            + config.bound_weight * bound
            + config.mirror_weight * mirror
            + drawn * imitation
        )
        descend(self.actor, self.optimiser, loss, config.actor_grad_norm, skip=far)
        outside = ((log_ratio.detach().exp() - 1.0).abs() > clip).float().mean()
        found = (kl, far, surrogate, bound, mirror, imitation, outside)
        return torch.stack([value.detach().double() for value in found])


class ActorSteps:
    """The numbers of an update's steps [7] each; reading them waits for the device, once."""

    def __init__(self, steps: Sequence[Tensor]) -> None:
        rows = torch.stack(list(steps)).tolist() if steps else []
        self._steps = [dict(zip(NUMBERS, row, strict=True)) for row in rows]
        self._taken = [step for step in self._steps if not step["skipped"]]
        self.skipped = len(self._steps) - len(self._taken)

    def mean(self, name: str) -> float:
        """Mean of a number over the steps that were taken; 0 without any."""
        return _mean([step[name] for step in self._taken])

    def kl(self, last: int) -> float:
        """Mean KL divergence of the last so many steps, taken or not."""
        return _mean([step["kl"] for step in self._steps[-last:]])


def _mean(numbers: list[float]) -> float:
    return sum(numbers) / len(numbers) if numbers else 0.0
