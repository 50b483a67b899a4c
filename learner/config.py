"""Settings of the learner; the defaults are the measured best of the two-core prototype."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

Schedule = tuple[tuple[float, float], ...]
"""(samples, value) points: linear between them, constant before the first and after the last."""


def piecewise(schedule: Sequence[tuple[float, float]], samples: float) -> float:
    """Value of a piecewise-linear schedule after so many samples."""
    if samples <= schedule[0][0]:
        return schedule[0][1]
    for (from_x, from_y), (to_x, to_y) in pairwise(schedule):
        if samples < to_x:
            return from_y + (to_y - from_y) * (samples - from_x) / (to_x - from_x)
    return schedule[-1][1]


@dataclass(frozen=True)
class LearnerConfig:
    """PPO with a fixed action noise, a learning rate driven by KL, and separate networks."""

    hidden: tuple[int, ...] = (512, 256)
    """Hidden widths of actor and critic; the paper's are 1024, 512."""
    skip: bool = False
    """A linear map from the observation beside the actor's layers: a teacher's action is mostly the
    present position of the joints."""
    sigma: Schedule = ((0.0, 0.035),)
    """Action noise, in units of the normalised action, by samples: ((0, 0.035), (4e7, 0.02))."""
    task_weight: float = 0.6
    """Weight of the task reward."""
    style_weight: float = 0.4
    """Weight of the style reward."""
    gamma: float = 0.985
    """Discount a control step."""
    lam: float = 0.95
    """Decay of generalised advantage estimation."""
    epochs: int = 3
    """Passes over the samples of an iteration."""
    minibatch: int = 2048
    """Samples a gradient step; rounded so that all minibatches are equal to within one."""
    clip: Schedule = ((0.0, 0.3),)
    """Clip of the likelihood ratio, by samples."""
    kl_target: Schedule = ((0.0, 0.06),)
    """Mean KL from the acting policy at the last epoch, by samples."""
    kl_skip: float = 4.0
    """The actor's step is skipped where the KL exceeds so many times the target."""
    actor_rate: float = 1e-4
    """Learning rate of the actor to start from."""
    actor_rate_bounds: tuple[float, float] = (1e-5, 1e-3)
    """The KL drives the actor's rate no further than this."""
    critic_rate: float = 5e-4
    """Learning rate of the critic, constant."""
    actor_grad_norm: float = 1.0
    """Gradient norm that the actor's is clipped to."""
    critic_grad_norm: float = 5.0
    """Gradient norm that the critic's is clipped to."""
    bound_weight: float = 10.0
    """Weight of the squared excess of a mean action over 1, summed over its components."""
    mirror_weight: float = 0.0
    """Weight of the mirror loss: where the critic thinks much better of a state than of its mirror
    image, the action in the image is drawn to the image of the action; 0, or a task whose networks
    know one side alone (lie): none."""
    imitation_weight: float = 0.0
    """Weight of the imitation loss, which draws the mean action to the teacher's action where the
    teacher (world.teacher) labels the state; 0: none."""
    average: float = 0.98
    """Share that the averaged actor, which evaluation and serving act with, keeps of itself an
    iteration; 0: the last actor."""
    warmup_iterations: int = 15
    """First iterations of a run, training the critic only: an untrained one destroys an actor that
    was cloned or loaded."""
    observation_clip: float = 5.0
    """Normalised observations are clipped at plus and minus this."""
    observation_std_floor: float = 1e-2
    """Smallest standard deviation that an observation is divided by."""
    threads: int = 2
    """1: actor after critic; 2: at the same time, each on one thread. The numbers are the same."""


@dataclass(frozen=True)
class LoopConfig:
    """How long a run goes on and how often it is written down."""

    iterations: int | None = None
    """Stop after so many PPO iterations."""
    samples: int | None = None
    """Stop after so many control steps over all scenes."""
    checkpoint_iterations: int = 200
    """A full checkpoint every so many iterations, and one at the end."""
    episode_window: int = 1024
    """Episode statistics are means over so many of the last episodes."""
    overlap: bool = False
    """Actors act while the learner learns: their policy is one update old."""
    max_policy_lag: int = 1
    """Rollouts by a policy older than so many updates are dropped and counted."""
    max_style_lag: int = 1
    """Likewise those that were scored by a discriminator so many trainings behind."""
