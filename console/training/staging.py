"""The training itself: one loop, or with a recipe one for each stage."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import torch

from console.commands import Train
from console.run import ancestors, assembly, machine, mixing, recipe
from console.run.directory import RunDirectory
from console.run.experiment import Experiment
from console.terminal import doing
from console.training import beginning
from console.training.runners import open_runner
from learner.config import LoopConfig
from learner.loop import Loop
from learner.protocols import Recorder, State
from learner.stages import Outcome
from policy.checkpoints.format import Checkpoint
from policy.checkpoints.lineage import Origin
from policy.checkpoints.numbering import numbered
from policy.checkpoints.run_checkpoints import RunCheckpoints


def workers(command: Train, experiment: Experiment) -> int:
    """Return the number of rollout workers: --actors, else one per thread, at most one per block
    of scenes."""
    wanted = command.actors or command.threads or machine.cores()
    return wanted if command.actors else max(1, min(wanted, experiment.scenes // experiment.block))


@dataclass(frozen=True)
class Training:
    """A training in a prepared run."""

    run: RunDirectory
    command: Train
    experiment: Experiment
    device: torch.device
    note: Callable[[str], None]
    """Takes a line for the user."""
    recorder: Recorder
    origins: Sequence[Origin]
    """Origins of the weights that it begins from."""

    def train(
        self,
        resumed: Checkpoint | None,
        stop: Callable[[], bool],
        begun: Callable[[int], None],
        running: Callable[[Loop], None] = lambda loop: None,
        saved: Callable[[], None] = lambda: None,
    ) -> None:
        """Train until a limit of the command, the end of the recipe, or `stop()`; write a last
        checkpoint.

        begun: called with the samples so far before the first iteration. running: called with the
        loop of each stage. saved: called once the last checkpoint is written.
        """
        number = 1 if resumed is None else beginning.stage_of(resumed)
        state: State | None = None
        outcome: Outcome = ""
        before = staged = recipe.staged(self.experiment, number)
        while True:
            with ExitStack() as stack:
                loop, ready = self._loop(stack, staged, number)
                if state is None:
                    if resumed is not None:  # their states are in the checkpoint
                        with doing("building scenes"):
                            ready()
                    beginning.initialise(loop, self.run, self.command, staged, self.note, resumed)
                else:
                    loop.begin_stage(state, outcome, self._of_other_task(state, before, staged))
                with doing("building scenes"):
                    ready()
                if state is None:
                    begun(loop.learner.samples)
                self._announce(number)
                running(loop)
                loop.run(stop)
                outcome = loop.stage_outcome()
                self._tell(loop, number, outcome)
                last = number >= len(self.experiment.stages)
                if not outcome or last or loop.finished or stop():
                    if numbered(self.run.checkpoints):
                        self.note(f"checkpoint {loop.learner.version} in {self.run.checkpoints}")
                    saved()
                    return
                state = loop.state_dict()
            number += 1
            before, staged = staged, recipe.staged(self.experiment, number)

    def _of_other_task(self, state: State, before: Experiment, staged: Experiment) -> State | None:
        """The networks and normalisers for a stage whose task is another than the one before; None
        where it is the same."""
        theirs, mine = assembly.layout(before), assembly.layout(staged)
        if theirs.task == mine.task:
            return None
        self.note(f"networks and normalisers from the task {theirs.task}; the rest begins anew")
        return ancestors.of_other_task(state["policy"], theirs, mine, str(self.run.path))

    def _loop(
        self, stack: ExitStack, staged: Experiment, number: int
    ) -> tuple[Loop, Callable[[], None]]:
        """The loop of a stage, and what waits for its scenes, which are built meanwhile."""
        command, run = self.command, self.run
        count = workers(command, staged)
        with doing("building scenes"):
            runner = stack.enter_context(
                open_runner(command, staged, run, count, self.note, self.device)
            )
        learner = assembly.learner(staged, self.device)
        if number == 1:
            self.note(learner.precision.reason)
        notes = assembly.notes(staged, self.origins)
        if staged.stages:
            notes |= {beginning.STAGE: str(number)}
        checkpoints = RunCheckpoints(run.checkpoints, assembly.layout(staged), notes, command.keep)
        loop = Loop(
            learner,
            runner.fleet,
            runner.style,
            self.recorder,
            checkpoints,
            LoopConfig(
                command.iterations, command.samples, command.checkpoint_every, lag=staged.lag
            ),
            mixing.term_names(staged),
            runner.kinds,
            mixing.division(staged),
            recipe.stage_end(staged, number, runner.kinds),
        )
        stack.callback(loop.close)
        return loop, runner.ready

    def _announce(self, number: int) -> None:
        if not self.experiment.stages:
            return
        stage = self.experiment.stages[number - 1]
        self.note(
            f"{self._called(number)} begins: until {recipe.condition(stage)} of"
            f" {stage.episodes:,} episodes, at most {stage.limit / 1e6:g} M samples"
        )

    def _tell(self, loop: Loop, number: int, outcome: Outcome) -> None:
        """Say how a stage ended, and at the end of the recipe which conditions failed."""
        if not outcome or loop.stage is None:
            return
        found = measured(loop.stage.success, loop.stage.measured(loop.episodes.metrics()))
        samples = f"{loop.learner.stage_samples / 1e6:.3g} M samples"
        unmet = [*filter(None, loop.unmet.split(","))]
        if outcome == "met":
            self.note(f"{self._called(number)} ended after {samples}: {found}")
        else:
            unmet.append(str(number))
            self.note(f"{self._called(number)} FAILED its condition within {samples}: {found}")
        if number == len(self.experiment.stages):
            end = f"failed: stage {', '.join(unmet)}" if unmet else "all conditions were met"
            self.note(f"the recipe has ended; {end}")

    def _called(self, number: int) -> str:
        stages = self.experiment.stages
        return f"stage {number} of {len(stages)}, {stages[number - 1].name},"


def measured(wanted: Mapping[str, float], found: Mapping[str, float]) -> str:
    """Return success rates beside the wanted ones, as in `near 0.412 of 0.40`."""
    return ", ".join(f"{kind} {found[kind]:.3f} of {least:.2f}" for kind, least in wanted.items())
