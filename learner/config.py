"""Settings of the learner; the defaults are the measured best on two cores."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

Schedule = tuple[tuple[float, float], ...]
"""(samples, value) points: linear between them, constant before the first and after the last. In a
run with stages, samples count from the beginning of the stage."""


def piecewise(schedule: Sequence[tuple[float, float]], samples: float) -> float:
    """Return the value of a piecewise-linear schedule at a number of samples."""
    if samples <= schedule[0][0]:
        return schedule[0][1]
    for (from_x, from_y), (to_x, to_y) in pairwise(schedule):
        if samples < to_x:
            return from_y + (to_y - from_y) * (samples - from_x) / (to_x - from_x)
    return schedule[-1][1]


@dataclass(frozen=True)
class LearnerConfig:
    """PPO: networks, rewards, update and learning rates.

    The action noise is fixed, the actor's learning rate follows the KL divergence, and actor and
    critic are separate networks.
    """

    hidden: tuple[int, ...] = (512, 256)
    """Widths of the hidden layers of actor and critic; the paper: 1024, 512."""
    skip: bool = False
    """Add a linear map from the observation to the actor's output: set-points are mostly near the
    present joint angles."""
    sigma: Schedule = ((0.0, 0.035),)
    """Standard deviation of the action noise, in units of the action, by samples, as in
    ((0, 0.035), (4e7, 0.02))."""
    task_weight: float = 0.6
    """Weight of the task reward."""
    style_weight: float = 0.4
    """Weight of the style reward."""
    gamma: float = 0.985
    """Discount factor of a control step."""
    lam: float = 0.95
    """Lambda of generalised advantage estimation."""
    epochs: int = 3
    """Epochs over the samples of an iteration."""
    minibatch: int = 2048
    """Samples in a gradient step; adjusted so that all minibatches are of equal size to within one
    sample."""
    clip: Schedule = ((0.0, 0.3),)
    """Clip range of the likelihood ratio, by samples."""
    kl_target: Schedule = ((0.0, 0.06),)
    """Target of the mean KL divergence from the acting policy in the last epoch, by samples."""
    kl_skip: float = 4.0
    """Multiple of the KL target beyond which a gradient step of the actor is skipped."""
    actor_rate: float = 1e-4
    """Initial learning rate of the actor."""
    actor_rate_bounds: tuple[float, float] = (1e-5, 1e-3)
    """Least and greatest learning rate of the actor."""
    critic_rate: float = 5e-4
    """Learning rate of the critic; it is constant."""
    actor_grad_norm: float = 1.0
    """Greatest gradient norm of the actor; larger gradients are scaled down."""
    critic_grad_norm: float = 5.0
    """Greatest gradient norm of the critic; larger gradients are scaled down."""
    bound_weight: float = 10.0
    """Weight of the bound loss: the squared excess of the mean action beyond 1 in magnitude, summed
    over its components."""
    mirror_weight: float = 0.0
    """Weight of the mirror loss: where the critic values a state much more than its mirror image,
    the action in the mirror image is drawn to the mirrored action; 0: none. It has no effect on a
    task whose observations show one side alone (lie)."""
    imitation_weight: float = 0.0
    """Weight of the imitation loss, which draws the mean action to the teacher's action where the
    teacher (world.walker, world.tracker, world.expert, world.track.teacher) labels the state;
    0: none."""
    imitation_samples: int = 0
    """Number of samples over which the weight of the imitation loss falls linearly to 0
    (kickstarting, arXiv:1803.03835); 0: it stays as it is."""
    average: float = 0.98
    """Decay of the averaged actor in an iteration; evaluation and serving use this average; 0: the
    last actor."""
    warmup_iterations: int = 15
    """Number of first iterations that train the critic alone: the gradients of an untrained critic
    destroy an actor that is cloned or loaded."""
    observation_clip: float = 5.0
    """Greatest magnitude of a normalised observation; larger ones are clipped."""
    observation_std_floor: float = 1e-2
    """Least standard deviation that an observation is divided by."""
    threads: int = 2
    """Threads of the update on the CPU. 1: actor after critic; 2: both at the same time, with the
    same numbers."""
    record: bool = True
    """On a GPU, record the kernels of the gradient steps of actor, critic and discriminator and
    replay them (CUDA graphs); off: start each kernel by itself. Nothing changes on the CPU."""

    def imitation(self, samples: float) -> float:
        """Return the weight of the imitation loss at a number of samples of the stage."""
        if not self.imitation_samples:
            return self.imitation_weight
        return self.imitation_weight * max(0.0, 1.0 - samples / self.imitation_samples)


@dataclass(frozen=True)
class LagConfig:
    """Overlap of acting and learning, and bounds on the age of the samples of an update."""

    overlap: bool = False
    """Collect the next rollout while the learner updates, by a policy that is one update old;
    off: lockstep."""
    max_policy: int = 1
    """Greatest age of the policy that made a sample, in updates; older samples are dropped and
    counted."""
    max_style: int = 1
    """Greatest age of the discriminator that scored a sample, in its trainings; older samples are
    dropped and counted."""


@dataclass(frozen=True)
class LoopConfig:
    """Length of a run, its checkpoints and its statistics."""

    iterations: int | None = None
    """Number of PPO iterations to stop after; none: no limit."""
    samples: int | None = None
    """Number of control steps over all scenes to stop after; none: no limit."""
    checkpoint_iterations: int = 200
    """Iterations between full checkpoints; one more is written at the end."""
    episode_window: int = 1024
    """Number of last episodes that the episode statistics are means over."""
    lag: LagConfig = field(default_factory=LagConfig)
    """How old the samples of an update may be."""
