"""Regression of an actor on labelled samples."""

import copy
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from learner.ppo import Learner
from world.character import model as character
from world.config import WorldConfig

#: Error of an action up to which the loss is quadratic; beyond it is linear.
_HUBER = 0.3
#: Number of batches over which the actor is averaged to the student.
_AVERAGED = 2000


def action_weights(world: WorldConfig) -> Tensor:
    """Return the weight of each action's error [28], by its torque, within bounds."""
    low, high = character.set_point_bounds()
    torque = torch.from_numpy(character.gains()[0] * world.action_scale * (high - low)).float()
    return (torque / torque.mean()).clamp(0.3, 3.0)


Canonical = Callable[[Tensor, Tensor], Sequence[Tensor]]
"""Observations [m, d] and their actions [m, 28] as the networks see them (Learner.canonical)."""


class Samples:
    """Buffer of the newest `capacity` observations and teacher actions."""

    def __init__(
        self,
        capacity: int,
        observation: int,
        device: torch.device,
        canonical: Canonical = lambda observations, actions: (observations, actions),
    ) -> None:
        """canonical: applied to what is added; a policy that acts on one side of its task alone
        is trained on that side."""
        self._canonical = canonical
        self.observations = torch.empty(capacity, observation, device=device)
        self.teacher_actions = torch.empty(capacity, character.NU, device=device)
        self.total = 0

    def add(self, observations: Tensor, teacher_actions: Tensor) -> None:
        """Add samples [m, d] and [m, 28]."""
        observations, teacher_actions = self._canonical(observations, teacher_actions)
        device, capacity = self.observations.device, len(self.observations)
        rows = ((self.total + torch.arange(len(observations))) % capacity).to(device)
        self.observations[rows] = observations.to(device)
        self.teacher_actions[rows] = teacher_actions.to(device)
        self.total += len(observations)

    def draw(self, n: int) -> tuple[Tensor, Tensor]:
        """Draw n samples, half of them from the newest third."""
        device, m = self.observations.device, min(self.total, len(self.observations))
        age = torch.randint(0, m, (n,), device=device)
        age[::2] %= max(1, m // 3)
        rows = (self.total - 1 - age) % len(self.observations)
        return self.observations[rows], self.teacher_actions[rows]


class Regression:
    """Regression of an actor on samples; its average is the student."""

    def __init__(self, learner: Learner, weights: Tensor, rate: float, batch: int) -> None:
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.learner, self._batch = learner, batch
        self.actor = copy.deepcopy(learner.actor).to(self.device)
        self.average = copy.deepcopy(self.actor).requires_grad_(False)
        self._weights = weights.to(self.device)
        self._optimiser = torch.optim.Adam(self.actor.parameters(), rate)
        self.steps = 0

    def begin(self, observations: Tensor, teacher_actions: Tensor) -> None:
        """Fix the normaliser, first fitted to samples [m, ..] where it is new, or knows not all
        features, as that of another task, whose actor goes on to act as it did; a new actor
        begins at the mean of the actions."""
        known = self.learner.normaliser.count > 0
        if not known.all():
            self.learner.update_normaliser(observations.cpu())
            for actor in (self.actor, self.average):
                actor.load_state_dict(self.learner.actor.state_dict())
        if not known.any():
            mean = teacher_actions.cpu().double().mean(dim=0)
            with torch.no_grad():
                for actor in (self.actor, self.average):
                    actor.head.bias.copy_(mean)
        normaliser = self.learner.normaliser
        self._mean = normaliser.mean.float().to(self.device)
        self._std = normaliser.std.to(self.device)

    def step(self, samples: Samples, rate: float) -> Tensor:
        """Train on one batch; return the mean squared error of its actions [], in their units."""
        for group in self._optimiser.param_groups:
            group["lr"] = rate
        observations, labels = samples.draw(self._batch)
        clip = self.learner.config.observation_clip
        found = self.actor(((observations - self._mean) / self._std).clamp_(-clip, clip))
        error = found - labels
        loss = self._weights * torch.nn.functional.smooth_l1_loss(
            error, torch.zeros_like(error), beta=_HUBER, reduction="none"
        )
        self._optimiser.zero_grad(set_to_none=True)
        loss.mean().backward()
        self._optimiser.step()
        self.steps += 1
        with torch.no_grad():
            mean: list[Tensor] = list(self.average.parameters())
            now: list[Tensor] = list(self.actor.parameters())
            torch._foreach_lerp_(mean, now, max(1.0 / _AVERAGED, 1.0 / self.steps))
        return error.detach().square().mean()

    def updated_learner(self) -> Learner:
        """Return the learner with the fitted actor and its average."""
        for mine, theirs in (
            (self.actor, self.learner.actor),
            (self.average, self.learner.average),
        ):
            theirs.load_state_dict(mine.state_dict())
        return self.learner
