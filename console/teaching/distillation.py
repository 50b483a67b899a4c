"""`inhabit distill`: policies that each know a part of a task teach one that does it whole.

The shards of training are the scenes, and what labels them is what labels them in training
(console.run.policy_teachers): a walker the way, a tracker the rest.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from console.commands.teaching import Distill, Labelled
from console.run import ancestors, assembly, mixing
from console.run.directory import policy_source
from console.run.experiment import Experiment
from console.run.policy_teachers import WALKERS, PolicyTeacher, policy_teachers
from console.serving.publish import require_published
from console.teaching import dagger
from console.terminal import doing
from learner.config import LearnerConfig
from policy.model.acting import Policy
from world import tasks
from world.character import model as character
from world.config import WorldConfig
from world.errors import ConfigError
from world.tasks.task import statistic

#: Control steps before a fall whose labels are dropped, as no action can prevent the fall then.
_BEFORE_FALL = 25
#: Mean number of control steps that the teachers drive at a time; fraction of the episodes that
#: the student drives alone.
_SPELL, _ALONE = 20.0, 0.1


class LabelledShard:
    """A shard whose teachers and a student drive in turn; a console.teaching.dagger.Labelling."""

    def __init__(self, practice: Labelled, world: WorldConfig, taught: PolicyTeacher) -> None:
        """taught: what labels the scenes."""
        n = practice.scenes
        library, bank = assembly.library_of(world), assembly.training_bank(world)
        teacher = taught.teacher(world, library, bank, n)
        self._practice = practice
        self.shard = assembly.shard(world, range(n), practice.seed, teacher=teacher)
        self._random = torch.Generator().manual_seed(practice.seed)
        self._noise = practice.noise * (torch.arange(n) % 2 == 0)[:, None]
        self._drives = torch.zeros(n, dtype=torch.bool)
        self._alone = torch.zeros(n, dtype=torch.bool)
        self._recent: list[tuple[Tensor, Tensor, Tensor]] = []

    def collect(self, student: Policy | None, spell: float) -> tuple[Tensor, Tensor, Tensor]:
        """See dagger.Labelling. Where there is no label the student drives."""
        width = sum(part.shape[1] for part in self.shard.observe())
        stages = self.shard.task.stages
        observations = [torch.zeros(0, width)]
        labels = [torch.zeros(0, character.NU)]
        ended = [torch.zeros(0, 3 + len(stages))]
        for _ in range(self._practice.steps):
            state, goal = self.shard.observe()
            seen, label = torch.cat((state, goal), dim=1), self.shard.label()
            assert label is not None, "a distillation has teachers"
            unknown = label.isnan().any(dim=1)
            action = torch.where(unknown[:, None], 0.0, label)
            if student is not None:
                changes = self._uniform() < torch.where(self._drives, 1.0 / spell, 1.0 / _SPELL)
                self._drives = (self._drives ^ changes) | self._alone
                own = (self._drives | unknown)[:, None]
                action = torch.where(own, student(state, goal), action)
            noise = torch.randn(action.shape, generator=self._random)
            step = self.shard.step(action + self._noise * noise)
            self._recent.append((seen, label, step.fell | ~step.finite))
            if len(self._recent) > _BEFORE_FALL:
                falls = torch.stack([fell for _, _, fell in self._recent]).any(dim=0)
                seen, label, _ = self._recent.pop(0)
                kept = label.isfinite().all(dim=1) & ~falls
                observations.append(seen[kept])
                labels.append(label[kept])
            over = step.end_ids
            if len(over):
                facts = (step.episodes["length"], step.episodes["fall"])
                shown = [step.episodes[statistic(name)] for name in stages]
                ended.append(torch.stack((self._alone[over].float(), *facts, *shown), dim=1))
                self._drives[over] = False
                self._alone[over] = (self._uniform() < _ALONE)[over] & (student is not None)
        return torch.cat(observations), torch.cat(labels), torch.cat(ended)

    def _uniform(self) -> Tensor:
        return torch.rand(self.shard.n, generator=self._random)


@dataclass(frozen=True)
class MakeShard:
    """Factory of one worker's scenes; can be pickled."""

    practice: Labelled
    world: WorldConfig
    taught: PolicyTeacher

    def __call__(self) -> LabelledShard:
        return LabelledShard(self.practice, self.world, self.taught)


def distill_command(command: Distill) -> int:
    """Train a student of the named policies."""
    world = resolve(command)
    if not command.dagger.hidden:
        raise ConfigError("--hidden must be one width or more")
    require_free(command.out, command.replace)
    seed = command.practice.seed
    ppo = LearnerConfig(hidden=command.dagger.hidden, observation_clip=10.0)
    taught = policy_teachers(Experiment(seed=seed, world=world, ppo=ppo), assembly.trained)
    if world.task not in taught:
        raise ConfigError(
            "nothing here teaches: name a policy that walks (--world.walker), one that follows"
            " clips (--world.tracker), one of the task itself (--world.expert), or more than one"
        )
    torch.set_num_threads(1)
    experiment = Experiment(seed=seed, world=mixing.untaught(world), ppo=ppo)
    with doing("reading furniture and clips"):
        student = assembly.learner(experiment)
        if command.init is not None:
            _, state, _ = ancestors.networks(command.init, experiment)
            student.load_policy_state({**state, "actor": state["average"]})
        sources = (command.init, world.walker, world.tracker, world.expert)
        notes = assembly.notes(experiment, ancestors.origins(sources))
    scenes = [
        MakeShard(replace(command.practice, seed=seed + 1000 * k), world, taught[world.task])
        for k in range(command.dagger.workers)
    ]
    stages = tasks.make(world.task).stages
    begun = command.init is not None
    dagger.teach(
        command.out,
        command.dagger,
        dagger.Lesson(scenes, experiment, student, begun, stages, notes),
    )
    return 0


def require_free(out: Path, replace: bool) -> None:
    """Raise ConfigError where a folder exists without `replace` or is no checkpoint.

    Raises RunError where it holds other files, which would be lost.
    """
    if not out.exists():
        return
    if not (out / "manifest.json").exists():
        raise ConfigError(f"{out} exists and is not a checkpoint: choose another folder")
    if not replace:
        raise ConfigError(f"{out} exists: add --replace, or name another folder")
    require_published(out)


def resolve(command: Distill) -> WorldConfig:
    """Return the world of the flags; ConfigError for a task that is not distilled, RunError for a
    teacher that is not there."""
    if command.task not in WALKERS:
        raise ConfigError(
            f"{command.task}: no task that is distilled: choose one of {', '.join(WALKERS)}"
        )
    task = tasks.make(command.task)
    world = replace(command.world, task=command.task)
    world = replace(world, episode_s=world.episode_s or task.episode_s)
    world = replace(world, classes=world.classes or task.affordance.classes)
    if command.motions:
        world = replace(world, motions=tuple(str(path.resolve()) for path in command.motions))
    named = {name: policy_source(getattr(world, name)) for name in ("walker", "tracker", "expert")}
    return replace(world, **named)
