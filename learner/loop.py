"""The training loop: gather, score, returns, update, train the discriminator, publish, record."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass

import torch
from torch import Tensor

from learner.config import LoopConfig
from learner.episodes import EpisodeWindow
from learner.errors import TrainingError
from learner.gathering import Gathered, Gathering
from learner.ppo import Learner
from learner.protocols import (
    AbandoningFleet,
    Checkpointer,
    Fleet,
    Recorder,
    State,
    Style,
    StyleScores,
)
from learner.returns import mixed_reward
from learner.segments import WORLD, Failures
from learner.stages import Outcome, StageEnd
from policy.checkpoints.trimmed import without_episodes
from policy.rollout import Abandoned, Rollout
from world.device import CPU, put
from world.teachers.teacher import UNTAUGHT

# Number of rollouts in a row beyond the lag bounds that end a run: it would never go on.
MAX_STALE_ROLLOUTS = 8
# Time of an update, s, beyond which one that is stopped is not completed: the state before it is
# then kept, where its copy takes at most the given fraction of an iteration.
LONG_UPDATE_S, COPY_FRACTION = 1.0, 0.05


@dataclass(frozen=True)
class _Scored:
    """Style reward of a rollout, and the discriminator's training on it, which runs in parallel."""

    scores: StyleScores
    training: Future[Mapping[str, float]]
    lag: int
    """Number of trainings that the discriminator was behind"""
    seconds: float


@dataclass(frozen=True)
class _Scores:
    """StyleScores of all scenes of a mixture: 0 where a task has no style reward."""

    reward: Tensor
    version: int
    metrics: Mapping[str, float]


@dataclass(frozen=True)
class Division:
    """The scenes of a mixture of tasks."""

    styled: Tensor
    """[N] bool: scenes whose reward has a style term; others have the task reward alone."""
    terms: Tensor
    """[N, terms] bool: the reward terms that a scene has."""


class Loop:
    """Training loop over a learner, a fleet and a style.

    The numbers do not depend on the implementations of fleet and style. In lockstep (lag 0) actors
    and learner wait for each other. Overlapped (lag 1) the actors act during the update. Both modes
    are reproducible and resume exactly.
    """

    def __init__(
        self,
        learner: Learner,
        fleet: Fleet,
        style: Style | None,
        recorder: Recorder,
        checkpointer: Checkpointer,
        config: LoopConfig,
        terms: Sequence[str] = (),
        categories: Sequence[str] = (),
        division: Division | None = None,
        stage: StageEnd | None = None,
    ) -> None:
        """division: of the scenes over the tasks of a mixture; None: one task. stage: end of the
        present stage of the training; None: a training without stages."""
        self.learner = learner
        self.fleet = fleet
        self.gathering = Gathering(fleet, config.lag.overlap, learner.device)
        self.style = style
        self.recorder = recorder
        self.checkpointer = checkpointer
        self.config = config
        self.terms = tuple(terms)
        self.division = division
        self.stage = stage
        self.unmet = ""
        """Numbers of the earlier stages that ended at their limit, as in 1,3."""
        window = config.episode_window if stage is None else stage.episodes
        self.episodes = EpisodeWindow(window, categories)
        self.failures = Failures()
        self.seconds = 0.0
        self.best_score = -math.inf
        self.batches = 0
        """Number of rollouts scored so far, which is the next batch id"""
        self._abandoned = False
        self._kept: State | None = None
        """State before the present update, where one that is stopped is not completed"""
        self._update_s, self._iteration_s, self._copy_s = math.inf, math.inf, 0.0
        self._unused: State = {}
        """State of the discriminator of earlier stages, in one without a style reward"""
        learner.abandoned = lambda: self._abandoned and self._kept is not None
        # The discriminator trains in parallel with the update, with the same numbers.
        self._background = ThreadPoolExecutor(
            1, "style", initializer=torch.set_num_threads, initargs=(1,)
        )

    def run(self, stop: Callable[[], bool] = lambda: False) -> None:
        """Iterate until a limit of the config, the end of the stage, `stop()` or `abandon`; write a
        last checkpoint."""
        began = self.learner.version
        saved = None
        while not (self.finished or self.stage_outcome() or stop() or self._abandoned):
            try:
                metrics = self.iterate()
            except Abandoned:
                break
            require_finite(self.learner.version, metrics)
            self.recorder.record(self.learner.version, metrics)
            if self.learner.version % self.config.checkpoint_iterations == 0:
                if self._abandoned:
                    break  # the rollout that was begun ahead is not waited for
                saved = self._checkpoint(metrics)
        if self._abandoned:
            if self.learner.version in (saved, began):
                return  # the newest checkpoint, if any, holds all that was learned
            self.gathering.rewind()
        if saved != self.learner.version and self.learner.version > 0:
            self._checkpoint(self.episodes.metrics())

    def abandon(self) -> None:
        """End `run` soon: the rollout at hand ends before its next control step and is dropped, and
        so is a long update. The last checkpoint is that of the last complete update, and resuming
        from it goes on bit for bit.

        For signal handlers and any thread. A fleet that cannot end a rollout completes it.
        """
        if isinstance(self.fleet, AbandoningFleet):
            self._abandoned = True
            self.fleet.abandon()

    def iterate(self) -> dict[str, float]:
        """One iteration; returns its metrics. Raises Abandoned after `abandon`."""
        began = time.perf_counter()
        learner, config = self.learner, self.learner.config
        version = learner.version

        gathered, style, dropped = self._gather()
        rollout = gathered.rollout
        scored = time.perf_counter()

        metrics: dict[str, float] = {}
        style_reward, score_s, style_s = None, 0.0, 0.0
        if style is not None:
            # a service answers on the CPU
            style_reward = put(style.scores.reward, rollout.rewards.device)
            score_s = style_s = style.seconds
            metrics |= style.scores.metrics
            metrics["lag/style"] = float(style.lag)
            metrics["reward/style"] = self._mean_style(rollout, style_reward)
        gather_s = scored - began - style_s

        styled = None if self.division is None else self.division.styled
        rewards = mixed_reward(
            rollout.rewards, style_reward, config.task_weight, config.style_weight, styled
        )
        metrics |= learner.update(rollout, rewards, gathered.sigma)
        updated = time.perf_counter()

        if style is not None:
            metrics |= style.training.result()
            style_s += time.perf_counter() - updated  # the rest of it runs beside the update

        ended_episodes = {name: put(value, CPU) for name, value in rollout.episodes.items()}
        self.episodes.add(ended_episodes)
        self.failures.add(ended_episodes)
        self.gathering.learned()
        self._kept = None
        ended = time.perf_counter()
        self._update_s, self._iteration_s = ended - scored + score_s, ended - began
        self.seconds += ended - began
        of = None if self.division is None else self.division.terms
        means = rollout.term_means(self.terms, of) if self.terms else {}
        return (
            metrics
            | self.episodes.metrics()
            | {f"reward/{name}": mean for name, mean in means.items()}
            | self._stage_metrics()
            | {
                "samples": float(learner.samples),
                "seconds": self.seconds,
                "rate/samples_per_s": rollout.samples / (ended - began),
                "rate/world_s": rollout.seconds.get("world", 0.0),
                "rate/policy_s": rollout.seconds.get("policy", 0.0),
                "rate/gather_s": gather_s,
                "rate/style_s": style_s,
                "rate/update_s": updated - scored,
                "rate/iteration_s": ended - began,
                "reward/task": float(rollout.rewards[rollout.valid].mean()),
                "lag/policy": float(version - rollout.version),
                "actors/alive": float(gathered.alive),
                "dropped/samples": float((~rollout.valid).sum() + dropped),
            }
        )

    def _gather(self) -> tuple[Gathered, _Scored | None, int]:
        """The next rollout whose policy lag and style lag are within the bounds of the config.

        Returns also the number of samples beyond the bounds, which are dropped. The discriminator
        trains on every rollout that it scores.
        """
        version, stale = self.learner.version, 0
        for _ in range(MAX_STALE_ROLLOUTS):
            weights = self.learner.weights() | self.failures.published()
            if self.learner.untaught:
                weights |= {WORLD + UNTAUGHT: torch.ones(1)}
            gathered = self.gathering.next(weights, version, self.learner.sigma)
            rollout = gathered.rollout
            if self._abandoned:
                raise Abandoned
            if version - rollout.version <= self.config.lag.max_policy:
                self._keep()
                style = self._score(rollout)
                if style is None or style.lag <= self.config.lag.max_style:
                    return gathered, style, stale
                style.training.result()
                self._kept = None
            stale += rollout.samples
        raise TrainingError(
            f"iteration {version + 1}: {MAX_STALE_ROLLOUTS} rollouts in a row are older than"
            f" --lag.max-policy {self.config.lag.max_policy} or were scored by a discriminator"
            f" older than --lag.max-style {self.config.lag.max_style}: raise the bounds, or find"
            " the lagging worker"
        )

    def _keep(self) -> None:
        """Copy the state before an update that is likely to take long, by the last one's time."""
        affordable = self._copy_s <= COPY_FRACTION * self._iteration_s
        if self._update_s > LONG_UPDATE_S and affordable:
            began = time.perf_counter()
            self._kept = self._sections()
            self._copy_s = time.perf_counter() - began

    def _score(self, rollout: Rollout) -> _Scored | None:
        """Score a rollout, and begin the discriminator's training on it; None without a style."""
        if self.style is None:
            return None
        began = time.perf_counter()
        batch, self.batches = self.batches, self.batches + 1
        scores = self._scored(self.style, batch, rollout)
        seconds = time.perf_counter() - began
        training = self._background.submit(self.style.train, scores.version)
        # One training follows each batch, so the lag is the batch id minus the version.
        return _Scored(scores, training, batch - scores.version, seconds)

    def _scored(self, style: Style, batch: int, rollout: Rollout) -> StyleScores:
        """The scores of a rollout; in a mixture, of the scenes that have a style reward."""
        ends, end_states = rollout.end_index, rollout.end_states
        if self.division is None:
            return style.score(batch, rollout.states, ends, end_states, rollout.valid)
        columns = torch.nonzero(self.division.styled).flatten().to(ends.device)
        place = torch.full((rollout.scenes,), -1, device=ends.device)
        place[columns] = torch.arange(len(columns), device=ends.device)
        kept = place[ends[:, 1]] >= 0
        ends = torch.stack((ends[kept, 0], place[ends[kept, 1]]), dim=1)
        found = style.score(
            batch,
            rollout.states[:, columns],
            ends,
            end_states[kept],
            rollout.valid[:, columns],
        )
        reward = torch.zeros(rollout.rewards.shape)
        reward[:, columns.cpu()] = found.reward.cpu()
        return _Scores(reward, found.version, found.metrics)

    def _mean_style(self, rollout: Rollout, reward: Tensor) -> float:
        """Mean style reward of the valid samples that have one."""
        valid = rollout.valid
        if self.division is not None:
            valid = valid & self.division.styled.to(valid.device)
        return float(reward[valid].mean())

    def stage_outcome(self) -> Outcome:
        """Whether the stage has ended, and how; it goes on for ever in a training without
        stages."""
        if self.stage is None:
            return ""
        samples, ended = self.learner.stage_samples, len(self.episodes)
        return self.stage.outcome(samples, ended, self.episodes.metrics())

    def _stage_metrics(self) -> dict[str, float]:
        if self.stage is None:
            return {}
        return {
            "recipe/stage": float(self.stage.number),
            "recipe/samples": float(self.learner.stage_samples),
            "recipe/unmet": float(len(self.unmet.split(",")) if self.unmet else 0),
        }

    @property
    def finished(self) -> bool:
        """Whether a limit of the config is reached."""
        iterations, samples = self.config.iterations, self.config.samples
        return (iterations is not None and self.learner.version >= iterations) or (
            samples is not None and self.learner.samples >= samples
        )

    def _checkpoint(self, metrics: Mapping[str, float]) -> int:
        # without a finished episode nothing is known of it: the best only where there is no other
        best = math.isinf(self.best_score) and not self.learner.stage_start
        if "episode/success" in metrics:
            score = metrics["episode/success"] + 1e-6 * metrics.get("episode/return", 0.0)
            best = score >= self.best_score
            self.best_score = max(self.best_score, score)
        self.checkpointer.save(self.learner.version, self.state_dict(), best)
        return self.learner.version

    def state_dict(self) -> State:
        """Everything that an exact restart needs, in the sections of a checkpoint."""
        own = self._kept or self._sections()
        return own | {
            "training": {
                **own["training"],
                **self.gathering.state_dict(),
                "episodes": self.episodes.state_dict(),
                "failures": self.failures.state_dict(),
                "seconds": self.seconds,
                "best_score": self.best_score if math.isfinite(self.best_score) else None,
                **self._stage_state(),
            },
        }

    def _sections(self) -> State:
        """Copies of what a score or an update changes, in the sections of a checkpoint."""
        return {
            "policy": self.learner.policy_state(),
            "training": {"learner": self.learner.state_dict(), "batches": self.batches},
            "style": self._unused if self.style is None else self.style.state_dict(),
        }

    def _stage_state(self) -> State:
        if self.stage is None:
            return {}
        return {"stage": {"number": self.stage.number, "unmet": self.unmet}}

    def begin_stage(self, state: State, outcome: Outcome, policy: State | None = None) -> None:
        """Go on from the state of a loop whose stage ended so: with its networks, optimisers and
        discriminator, while all episodes and their statistics begin anew.

        policy: after a stage of another task, its networks and normalisers in this task's layout.
        Only they, the counters and the actor's learning rate go on; optimisers and discriminator
        are new, and the critic warms up again.
        """
        learner, training = self.learner, state["training"]
        before = training["stage"]
        if policy is None:
            self._load_learning(state, anew=True)
        else:
            learner.load_policy_state(policy)
            learner.go_on_from(training["learner"])
            self.seconds = float(training["seconds"])
        learner.stage_start = learner.samples
        missed = [str(before["number"])] if outcome == "limit" else []
        self.unmet = ",".join([*filter(None, before["unmet"].split(",")), *missed])

    def _load_learning(self, state: State, anew: bool) -> None:
        """anew: all episodes begin anew."""
        training = state["training"]
        self.learner.load_policy_state(state["policy"])
        self.learner.load_state_dict(training["learner"])
        # Absent in checkpoints of older runs, whose batch ids were their iterations.
        self.batches = int(training.get("batches", self.learner.version))
        if "failures" in training:  # older runs counted none
            self.failures.load_state_dict(training["failures"])
        self.seconds = float(training["seconds"])
        style = state["style"]
        style = without_episodes(style) if anew else style
        if self.style is None:
            self._unused = style
        elif style:  # else no stage so far had a style reward: the discriminator is new
            self.style.load_state_dict(style)

    def load_state_dict(self, state: State) -> None:
        """Restore a state: the run goes on bit for bit as if it had not stopped."""
        training = state["training"]
        self._load_learning(state, anew="fleet" not in training)
        self.gathering.load_state_dict(training)
        self.episodes.load_state_dict(training["episodes"])
        best = training["best_score"]
        self.best_score = -math.inf if best is None else float(best)
        self.unmet = training.get("stage", {}).get("unmet", "")

    def close(self) -> None:
        """End the threads; fleet and style stay open."""
        self.gathering.close()
        self._background.shutdown()
        self.learner.close()


def require_finite(iteration: int, metrics: Mapping[str, float]) -> None:
    """Raise TrainingError, naming the metrics that are not finite."""
    broken = [name for name, value in metrics.items() if not math.isfinite(value)]
    if broken:
        raise TrainingError(
            f"iteration {iteration}: {', '.join(broken)} not finite; the last checkpoint is kept:"
            " resume from it with a lower learning rate or action noise"
        )
