"""Our scenes as the vectorised environment of a peer: observations, rewards and ends of episodes.

A shard starts the next episode in the step that ends one, and returns the last observation of the
old one beside. Peers differ in what they want: the next episode's first observation at once
(rsl_rl, skrl), the old one's last and a reset on request (TorchRL), or the old one's last and the
first in a step of its own (RLlib: gymnasium's NEXT_STEP).
"""

from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

import numpy as np
import torch
import torch.multiprocessing as processes
from torch import Tensor

from actors.local import divide
from actors.ray_actor import MakeShard
from actors.worker import ShardLike
from console.bench.peers.counters import counted
from console.bench.peers.protocol import Assignment
from console.run import assembly
from console.run.experiment import Experiment
from world.character.model import NU
from world.errors import InhabitError

_JOIN_S = 10.0
_DONE = b"done"


class ScenesError(InhabitError):
    """A worker process of the scenes failed."""


@dataclass(frozen=True)
class Transition:
    """A control step of n scenes; d: state and goal."""

    observation: Tensor
    """[n, d]: where an episode ended, the next one's first."""
    reward: Tensor
    """[n]: the task reward; 0 where the scene became non-finite."""
    terminated: Tensor
    """[n] bool: ended in a terminal state, or non-finite: a peer cannot drop a sample."""
    truncated: Tensor
    """[n] bool: ended by a time limit or by success."""
    successor: Tensor
    """[n, d]: where an episode ended, its last observation; of a non-finite scene the one before
    the step."""


class Scenes(Protocol):
    """Scenes that step together."""

    @property
    def observation(self) -> Tensor:
        """The present observations [n, d]."""
        ...

    def step(self, actions: Tensor) -> Transition:
        """One control step with actions [n, 28]."""
        ...


class ShardScenes:
    """The scenes of one shard, in this process."""

    def __init__(self, shard: ShardLike) -> None:
        self._shard = shard
        self.observation = self._observed()

    def step(self, actions: Tensor) -> Transition:
        """One control step with actions [n, 28]."""
        before = self.observation
        step = self._shard.step(actions)
        self.observation = self._observed()
        successor = torch.where(step.finite[:, None], self.observation, before)
        successor[step.end_ids] = torch.cat((step.end_states, step.end_goals), -1)
        return Transition(
            observation=self.observation,
            reward=torch.where(step.finite, step.reward, 0.0),
            terminated=step.fell | ~step.finite,
            truncated=step.timed_out & step.finite,
            successor=successor,
        )

    def _observed(self) -> Tensor:
        return torch.cat(self._shard.observe(), -1)


@dataclass(frozen=True)
class MakeScenes:
    """Factory of an experiment's shards; it can be pickled."""

    experiment: Experiment

    def __call__(self, scenes: range) -> ShardLike:
        return assembly.shard(self.experiment.world, scenes, self.experiment.seed)


def width(experiment: Experiment) -> int:
    """Return the width of an observation: state and goal."""
    return assembly.layout(experiment).observation


class ProcessScenes:
    """Scenes in worker processes, each with a shard; arrays are in shared memory.

    Threads of one process step at half the rate (actors/processes.py).
    """

    def __init__(
        self, make: MakeShard, scenes: int, observation: int, workers: int, block: int, actions: int
    ) -> None:
        """observation, actions: widths. block: scenes are divided in whole blocks."""
        self.n = scenes
        shared = _Shared.of(scenes, observation, actions)
        self._shared = shared
        context = processes.get_context("spawn")
        self._pipes: list[Connection] = []
        self._processes = []
        try:
            for owned in divide(scenes, block, workers):
                ours, theirs = context.Pipe()
                process = context.Process(
                    target=_step_scenes, args=(theirs, make, owned, shared), daemon=True
                )
                process.start()
                theirs.close()
                self._pipes.append(ours)
                self._processes.append(process)
            self._wait()
        except BaseException:
            self.close()
            raise

    @property
    def observation(self) -> Tensor:
        """The present observations [n, d], a copy."""
        return self._shared.observation.clone()

    def step(self, actions: Tensor) -> Transition:
        """One control step with actions [n, 28]."""
        self._shared.actions.copy_(actions)
        for pipe in self._pipes:
            pipe.send_bytes(b"step")
        self._wait()
        shared = self._shared
        return Transition(
            observation=shared.observation.clone(),
            reward=shared.reward.clone(),
            terminated=shared.terminated.clone(),
            truncated=shared.truncated.clone(),
            successor=shared.successor.clone(),
        )

    def _wait(self) -> None:
        said = [pipe.recv_bytes() for pipe in self._pipes]
        for word in said:
            if word != _DONE:
                raise ScenesError(word.decode())

    def close(self) -> None:
        """End the processes."""
        for pipe in self._pipes:
            pipe.close()
        for process in self._processes:
            process.join(_JOIN_S)
            if process.is_alive():
                process.kill()
                process.join()
        self._pipes, self._processes = [], []


@dataclass(frozen=True)
class _Shared:
    """Arrays of all scenes in shared memory."""

    actions: Tensor
    observation: Tensor
    successor: Tensor
    reward: Tensor
    terminated: Tensor
    truncated: Tensor

    @staticmethod
    def of(scenes: int, observation: int, actions: int) -> "_Shared":
        flag = torch.bool
        return _Shared(
            actions=torch.zeros(scenes, actions).share_memory_(),
            observation=torch.zeros(scenes, observation).share_memory_(),
            successor=torch.zeros(scenes, observation).share_memory_(),
            reward=torch.zeros(scenes).share_memory_(),
            terminated=torch.zeros(scenes, dtype=flag).share_memory_(),
            truncated=torch.zeros(scenes, dtype=flag).share_memory_(),
        )


def _step_scenes(pipe: Connection, make: MakeShard, owned: range, shared: _Shared) -> None:
    """Main loop of a worker's process: a step for each message until the pipe closes."""
    torch.set_num_threads(1)
    scenes, rows = ShardScenes(make(owned)), slice(owned.start, owned.stop)
    shared.observation[rows] = scenes.observation
    try:
        pipe.send_bytes(_DONE)
        while True:
            pipe.recv_bytes()
            try:
                found = scenes.step(shared.actions[rows])
            except Exception as error:
                pipe.send_bytes(f"{type(error).__name__}: {error}".encode())
                return
            shared.observation[rows] = found.observation
            shared.successor[rows] = found.successor
            shared.reward[rows] = found.reward
            shared.terminated[rows] = found.terminated
            shared.truncated[rows] = found.truncated
            pipe.send_bytes(_DONE)
    except (EOFError, OSError):
        return


def factory(assignment: Assignment) -> MakeShard:
    """Return the factory of an assignment's shards, counted where it says so."""
    return counted(MakeScenes(assignment.experiment), assignment.counters)


def in_processes(assignment: Assignment) -> ProcessScenes:
    """Return an assignment's scenes in worker processes."""
    experiment, make = assignment.experiment, factory(assignment)
    wide = width(experiment)
    return ProcessScenes(make, experiment.scenes, wide, assignment.threads, experiment.block, NU)


class NextStep:
    """Scenes with gymnasium's NEXT_STEP resets, in numpy.

    The step after an end returns the next episode's first observation, reward 0 and no end. The
    shard has already reset the scene, and steps it once from there with action 0; an end in that
    one step is not seen, and the episode after it begins.
    """

    def __init__(self, scenes: Scenes) -> None:
        self._scenes = scenes
        self._waiting = torch.zeros(len(scenes.observation), dtype=torch.bool)

    def reset(self) -> np.ndarray:
        """Return the present observations [n, d]; the shard's scenes are always in an episode."""
        self._waiting.zero_()
        return self._scenes.observation.numpy()

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return observations [n, d], rewards [n], terminated [n] and truncated [n]."""
        waiting = self._waiting
        driven = torch.where(waiting[:, None], 0.0, torch.from_numpy(actions))
        found = self._scenes.step(driven)
        seen = torch.where(waiting[:, None], found.observation, found.successor)
        reward = torch.where(waiting, 0.0, found.reward)
        terminated, truncated = found.terminated & ~waiting, found.truncated & ~waiting
        self._waiting = terminated | truncated
        return seen.numpy(), reward.numpy(), terminated.numpy(), truncated.numpy()
