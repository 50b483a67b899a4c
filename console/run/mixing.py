"""What an experiment's mixture of tasks means for its scenes, networks, rewards and metrics."""

from dataclasses import replace

import torch
from torch import Tensor

from console.run.experiment import Experiment
from learner.loop import Division
from policy.checkpoints.folding import Folding, folded
from policy.checkpoints.format import State
from policy.model.normaliser import NormaliserConfig
from world import tasks
from world.character.features import STATE
from world.config import WorldConfig
from world.episodes.mixed import kinds
from world.errors import ConfigError
from world.initial.reference import KINDS
from world.tasks import mixture as mixtures
from world.tasks import reward
from world.tasks.mixture import Mixture


def mixture_of(experiment: Experiment) -> Mixture | None:
    """Return the mixture of tasks of an experiment; None where it has one task.

    Raises ConfigError for shares and settings that no mixture can have.
    """
    world = experiment.world
    if not experiment.mix:
        if world.track.goal:
            raise ConfigError(
                f"--world.track.goal {world.track.goal}: only a mixture shows another task's goal:"
                f" add --mix track=0.5 {world.track.goal}=0.5"
            )
        return None
    found = mixtures.shares(experiment.mix, world.task)
    return mixtures.mixture(found, experiment.block, world.track.goal)


def worlds(experiment: Experiment) -> tuple[WorldConfig, ...]:
    """Return the settings of the scenes of each task of an experiment."""
    mixed = mixture_of(experiment)
    return (experiment.world,) if mixed is None else mixed.worlds(experiment.world)


def hidden_columns(mixed: Mixture) -> Tensor:
    """Return the mask [d] bool of (state, goal) that the critic alone observes."""
    return torch.cat((torch.zeros(STATE.width, dtype=torch.bool), mixed.hidden))


def folding(mixed: Mixture, task: str) -> Folding:
    """Return what the scenes of a task observe of a mixture's (state, goal); ConfigError where the
    policy never sees that task's goal."""
    own = torch.cat((torch.arange(STATE.width), STATE.width + mixed.own(task)))
    marks = mixed.marks[mixed.number(task)]
    constant = torch.cat((torch.zeros(STATE.width), marks))
    return Folding(own, constant, hidden_columns(mixed))


def of_one_task(experiment: Experiment, state: State, task: str = "") -> tuple[Experiment, State]:
    """Return the experiment and the policy of one task of a mixture, by default its first; without
    a mixture, those given.

    Raises ConfigError for a task that the policy was not trained for.
    """
    mixed = mixture_of(experiment)
    if mixed is None:
        if task not in ("", experiment.world.task):
            raise ConfigError(f"--task {task}: this policy is of the task {experiment.world.task}")
        return experiment, state
    wanted = task or mixed.names[0]
    found = folding(mixed, wanted)
    world = untaught(mixed.worlds(experiment.world)[mixed.number(wanted)])
    ppo = experiment.ppo
    limits = NormaliserConfig(ppo.observation_clip, ppo.observation_std_floor)
    return replace(experiment, world=world, mix=()), folded(state, found, limits)


def untaught(world: WorldConfig) -> WorldConfig:
    """Return a world without the policies that teach, which training alone has."""
    return replace(
        world,
        walker="",
        tracker="",
        expert="",
        track=replace(world.track, goal="", teacher="", walker="", rollouts=""),
    )


def division(experiment: Experiment) -> Division | None:
    """Return the division of the scenes over the tasks of a mixture; None without one.

    Scenes that follow clips have the task reward alone: the reference is their style.
    """
    mixed = mixture_of(experiment)
    if mixed is None:
        return None
    scenes = experiment.scenes
    styled = torch.zeros(scenes, dtype=torch.bool)
    counts = [len(reward.weights(part, experiment.world.penalty)) for part in mixed.parts]
    terms = torch.zeros(scenes, sum(counts), dtype=torch.bool)
    first = 0
    for k, part in enumerate(mixed.parts):
        own = mixed.scenes(k, range(scenes), experiment.block)
        styled[own] = not part.affordance.follows_clips
        terms[own, first : first + counts[k]] = True
        first += counts[k]
    return Division(styled, terms)


def term_names(experiment: Experiment) -> list[str]:
    """Return the names of the reward terms; of a mixture, TASK_TERM each."""
    mixed = mixture_of(experiment)
    if mixed is None:
        return list(reward.weights(tasks.make(experiment.world.task), experiment.world.penalty))
    penalty = experiment.world.penalty
    return [f"{part.name}_{term}" for part in mixed.parts for term in reward.weights(part, penalty)]


def kind_names(experiment: Experiment) -> tuple[str, ...]:
    """Return the names of the categories of initial states; of a mixture, TASK_KIND each."""
    mixed = mixture_of(experiment)
    return KINDS if mixed is None else kinds(mixed)
