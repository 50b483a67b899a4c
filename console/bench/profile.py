"""`inhabit bench profile`: processor time of a training iteration by part, and MuJoCo's own parts.

Processor time, unlike wall time, hardly depends on other load: a thread's clock stands still while
it waits.
"""

import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import torch
from mujoco.batch import Batch
from torch import Tensor

from actors.local import LocalFleet
from actors.worker import Worker
from console.bench.peers.ours import Nowhere
from console.bench.turns import turns
from console.run import assembly, mixing
from console.run.directory import RunDirectory, checkpoint_folder
from console.run.experiment import Experiment
from discriminator.trainer import Discriminator
from learner.config import LagConfig, LoopConfig
from learner.loop import Loop
from learner.ppo import Learner
from policy.checkpoints.format import read
from policy.model.acting import Policy
from world import quiet
from world.character import model as character
from world.episodes.shard import Shard

WARM_UP = 2
"""Iterations before the measurement."""
#: Parts of an iteration: what a part is called, and the methods whose own time it is.
PARTS: tuple[tuple[str, type, str], ...] = (
    ("physics", Batch, "step"),
    ("resets", Shard, "_reset"),
    ("features_and_rewards", Shard, "step"),
    ("policy", Policy, "__call__"),
    ("gather", Worker, "rollout"),
    ("gather", LocalFleet, "collect"),
    ("score", Discriminator, "score"),
    ("discriminator", Discriminator, "train"),
    ("critic", Learner, "_update_critic"),
    ("actor", Learner, "_update_actor"),
    ("returns_and_normalisers", Learner, "update"),
    ("loop", Loop, "iterate"),
)
_TIMER = mujoco.mjtTimer
#: Parts of MuJoCo's step, by its timers.
PHYSICS = {
    "kinematics": _TIMER.mjTIMER_POS_KINEMATICS,
    "inertia": _TIMER.mjTIMER_POS_INERTIA,
    "collision": _TIMER.mjTIMER_POS_COLLISION,
    "constraint_rows": _TIMER.mjTIMER_POS_MAKE,
    "velocity": _TIMER.mjTIMER_VELOCITY,
    "actuation": _TIMER.mjTIMER_ACTUATION,
    "solver": _TIMER.mjTIMER_CONSTRAINT,
    "integration": _TIMER.mjTIMER_ADVANCE,
}
#: Scenes whose steps are timed by MuJoCo, and control steps of each from the same state.
_SCENES, _REPEATS = 64, 9


class Stopwatch:
    """Processor time of methods, without that of other timed methods that they call."""

    def __init__(self, clock: Callable[[], float] = time.thread_time) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._clock = clock
        self._lock = threading.Lock()
        self._inner = threading.local()

    def reset(self) -> None:
        """Begin again at 0."""
        self.seconds.clear()

    @contextmanager
    def watching(self, parts: Sequence[tuple[str, type, str]]) -> Iterator[None]:
        """Time the methods of the classes meanwhile, by the names of the parts."""
        with ExitStack() as stack:
            for name, owner, method in parts:
                original = owner.__dict__[method]
                stack.callback(setattr, owner, method, original)
                setattr(owner, method, self._timed(name, original))
            yield

    def _timed(self, name: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any, **named: Any) -> Any:
            outer = getattr(self._inner, "seconds", 0.0)
            self._inner.seconds, began = 0.0, self._clock()
            try:
                return original(*arguments, **named)
            finally:
                spent = self._clock() - began
                with self._lock:
                    self.seconds[name] += spent - self._inner.seconds
                self._inner.seconds = outer + spent

        return timed


def measure(source: Path, seconds: float, threads: int) -> dict[str, float]:
    """Return the processor time of each part by sample, and the shares of MuJoCo's parts.

    source: a policy's name, a run or a checkpoint, whose own settings train on; threads: actors
    that share the scenes. `other` is what no part accounts for, such as threads of libraries.
    """
    path = checkpoint_folder(source)
    found = read(path, ("policy",))
    experiment = assembly.experiment_of(found.manifest, path)
    experiment = replace(
        experiment,
        lag=LagConfig(),
        ppo=replace(experiment.ppo, warmup_iterations=0, threads=1),
    )
    watch = Stopwatch()
    with ExitStack() as stack:
        student = assembly.learner(experiment)
        stack.callback(student.close)
        student.load_policy_state(found.state["policy"])
        fleet = _fleet(experiment, min(threads, experiment.scenes // experiment.block))
        stack.callback(fleet.close)
        styled = experiment.ppo.style_weight > 0.0
        style = assembly.discriminator(experiment) if styled else None
        loop = Loop(
            student,
            fleet,
            style,
            Nowhere(),
            Nowhere(),
            LoopConfig(),
            mixing.term_names(experiment),
            mixing.kind_names(experiment),
            mixing.division(experiment),
        )
        stack.callback(loop.close)
        with watch.watching(PARTS):
            for _ in range(WARM_UP):
                loop.iterate()
            watch.reset()
            count, began = 0, time.process_time()
            for turn in turns(seconds, 1, clock=time.process_time):
                loop.iterate()
                count = turn + 1
            whole = time.process_time() - began
        state = fleet.workers[0].state_dict()
    samples = count * experiment.scenes * experiment.horizon
    spent = {name: watch.seconds[name] for name in dict.fromkeys(name for name, _, _ in PARTS)}
    spent["other"] = whole - sum(spent.values())
    return {
        "samples_per_core_s": samples / whole,
        "processor_us_per_sample": 1e6 * whole / samples,
        **{f"{name}_processor_us_per_sample": 1e6 * s / samples for name, s in spent.items()},
        **{f"{name}_of_iteration_ratio": s / whole for name, s in spent.items()},
        **(physics(experiment, state) if "variant" in state else {}),
    }


def physics(experiment: Experiment, state: dict[str, Tensor]) -> dict[str, float]:
    """Return the shares of the parts of MuJoCo's step from a shard's state, by its own timers, and
    the mean contacts, constraint rows and solver iterations of a substep.

    The timers run on while the thread waits for a core: of several control steps from the same
    state, the shortest time of each part counts.
    """
    models = assembly.training_bank(experiment.world).models
    scenes = min(_SCENES, len(state["variant"]))
    spent = torch.zeros(len(PHYSICS) + 1, dtype=torch.float64)
    counted = torch.zeros(3, dtype=torch.float64)
    with quiet.timers():
        for scene in range(scenes):
            model = models[int(state["variant"][scene])]
            data = mujoco.MjData(model)
            found: list[Tensor] = []
            for _ in range(_REPEATS):
                mujoco.mj_resetData(model, data)
                for name in ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat"):
                    getattr(data, name)[:] = state[f"physics_{name}"][scene].numpy()
                for _ in range(character.SUBSTEPS):
                    mujoco.mj_step(model, data)
                    counts = (data.ncon, data.nefc, int(data.solver_niter.sum()))
                    counted += torch.tensor(counts) / _REPEATS
                timers = (*PHYSICS.values(), _TIMER.mjTIMER_STEP)
                found.append(torch.tensor([data.timer[timer].duration for timer in timers]))
            spent += torch.stack(found).amin(dim=0)
    shares = (spent[:-1] / spent[-1]).tolist()
    contacts, rows, iterations = (counted / (scenes * character.SUBSTEPS)).tolist()
    return {
        **{f"{n}_of_physics_ratio": share for n, share in zip(PHYSICS, shares, strict=True)},
        "rest_of_physics_ratio": 1.0 - sum(shares),
        "contacts_per_substep": contacts,
        "constraint_rows_per_substep": rows,
        "solver_iterations_per_substep": iterations,
    }


def _fleet(experiment: Experiment, workers: int) -> LocalFleet:
    """Return the scenes of an experiment in threads of this process, whose parts can be timed."""
    make = assembly.make_shard(experiment, RunDirectory(Path("profile")))
    shape = (experiment.scenes, experiment.block, workers, experiment.seed, experiment.horizon)
    torch.set_num_threads(1)
    return LocalFleet(make, *shape)
