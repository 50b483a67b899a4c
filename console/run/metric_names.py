"""Table of all metrics of a training: name, unit, meaning, and when they are written.

A name with `TERM`, `STAGE`, `CAUSE` or `START` stands for one metric per reward term, stage or
cause of failure of the task, or per category of initial states.
"""

import re
from dataclasses import dataclass

ALWAYS, ENDED = "always", "once an episode has ended"


@dataclass(frozen=True)
class Metric:
    """One row of the table."""

    name: str
    unit: str
    meaning: str
    when: str = ALWAYS

    def matches(self, name: str) -> bool:
        """True if a written name belongs to this metric."""
        pattern = re.sub("TERM|STAGE|START|CAUSE", "[a-z_]+", re.escape(self.name))
        return re.fullmatch(pattern, name) is not None


METRICS = (
    Metric("iteration", "", "number of the iteration, from 1"),
    Metric("samples", "samples", "control steps over all scenes that updates have used so far"),
    Metric("seconds", "s", "wall time of all iterations of the run"),
    Metric("reward/task", "", "mean weighted task reward of a control step"),
    Metric("reward/style", "", "mean style reward of a control step, -log(1 - D)"),
    Metric("reward/TERM", "", "mean of one reward term or penalty, before its weight"),
    Metric(
        "episode/return",
        "",
        "mean task return of the last 1,024 episodes, with --recipe of as many as the stage says",
        ENDED,
    ),
    Metric("episode/length", "control steps", "mean length of these episodes", ENDED),
    Metric("episode/success", "fraction", "fraction of them that ended in success", ENDED),
    Metric("episode/fall", "fraction", "fraction of them that ended in a fall", ENDED),
    Metric("episode/stalled", "fraction", "fraction of them that the stall time-out ended", ENDED),
    Metric("episode/stage_STAGE", "fraction", "fraction that reached a stage of the task", ENDED),
    Metric("episode/end_CAUSE", "fraction", "fraction that ended by a cause of failure", ENDED),
    Metric(
        "episode/success_START",
        "fraction",
        "episode/success of one category of initial states",
        "once such an episode has ended",
    ),
    Metric("episode/fall_START", "fraction", "episode/fall of one category", "likewise"),
    Metric("episode/length_START", "control steps", "episode/length of one category", "likewise"),
    Metric("recipe/stage", "", "number of the recipe's stage, from 1", "with --recipe"),
    Metric("recipe/samples", "samples", "samples of this stage so far", "with --recipe"),
    Metric(
        "recipe/unmet",
        "",
        "number of earlier stages that ended at their limit of samples, not by their condition",
        "with --recipe",
    ),
    Metric("ppo/kl", "nat", "mean KL divergence from the acting policy in the last epoch"),
    Metric("ppo/clip_fraction", "fraction", "samples with a clipped likelihood ratio"),
    Metric("ppo/learning_rate", "", "learning rate of the actor, which follows the KL divergence"),
    Metric("ppo/surrogate", "", "mean clipped surrogate loss"),
    Metric("ppo/bound", "", "mean penalty of mean actions beyond 1"),
    Metric("ppo/mirror", "", "mean mirror loss", "with ppo.mirror_weight"),
    Metric(
        "ppo/imitation", "", "mean imitation loss towards the teacher's actions", "with a teacher"
    ),
    Metric("ppo/skipped", "steps", "actor steps that were skipped because of the KL divergence"),
    Metric("ppo/sigma", "actions", "standard deviation of the action noise"),
    Metric("ppo/value_loss", "", "mean loss of the value function, normalised returns"),
    Metric("ppo/value_explained", "fraction", "explained variance of the returns"),
    Metric("style/loss", "", "discriminator loss, mean over its steps"),
    Metric("style/penalty", "", "gradient penalty, mean over its steps"),
    Metric("style/logit_mocap", "", "mean logit of mocap transitions"),
    Metric("style/logit_policy", "", "mean logit of the policy's transitions"),
    Metric(
        "style/logit_gap", "", "mean logit of held-out mocap, less that of the policy's transitions"
    ),
    Metric("style/gradient", "", "rms norm of the logit's gradient on mocap"),
    Metric("style/reward_spread", "", "standard deviation of the style reward over a rollout"),
    Metric("style/skipped", "fraction", "trainings of the discriminator that the throttle skipped"),
    Metric("style/accuracy_mocap", "fraction", "held-out mocap transitions classified as mocap"),
    Metric("style/accuracy_policy", "fraction", "policy transitions classified as policy"),
    Metric("lag/policy", "updates", "updates between the acting policy and this one"),
    Metric("lag/style", "trainings", "trainings that the discriminator is behind"),
    Metric("actors/alive", "", "rollout workers that took part"),
    Metric("dropped/samples", "samples", "dropped samples: non-finite scenes, stale rollouts"),
    Metric("rate/samples_per_s", "samples/s", "samples of the iteration over its wall time"),
    Metric("rate/iteration_s", "s", "wall time of the iteration"),
    Metric("rate/gather_s", "s", "wall time of gathering the rollout"),
    Metric("rate/world_s", "s", "time in the simulator, of the slowest actor"),
    Metric("rate/policy_s", "s", "time in the policy network, of the slowest actor"),
    Metric("rate/style_s", "s", "wall time of scoring, and of waiting for the discriminator"),
    Metric("rate/update_s", "s", "wall time of the PPO update"),
    Metric("rate/actor_s", "s", "time of the actor's part of the update"),
    Metric("rate/critic_s", "s", "time of the critic's part of the update"),
)
