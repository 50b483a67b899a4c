"""Costs of a sample, measured on this machine in a few seconds."""

import time
from collections.abc import Callable
from dataclasses import replace
from statistics import median

from actors.worker import Worker
from console.plan.estimate import Costs, Fleet, act_flop, update_flop
from console.run import assembly
from console.run.experiment import Experiment

#: Most scenes of the actor that is measured: fewer cost more each, more take longer to make.
_SCENES = 256


def measure(experiment: Experiment, fleet: Fleet, seconds: float) -> Costs:
    """Measure an actor, an update and the discriminator, each for a third of `seconds`.

    What an actor costs is processor time, which other load hardly changes; update and discriminator
    are wall time: keep the machine quiet. Receiving is not measured (`inhabit bench scaling`).
    """
    experiment = replace(experiment, ppo=replace(experiment.ppo, warmup_iterations=0))
    blocks = min(_SCENES, fleet.scenes // fleet.actors) // experiment.block
    owned = range(max(1, blocks) * experiment.block)
    shard = assembly.shard(experiment.world, owned, experiment.seed)
    worker = Worker(shard, owned, experiment.seed, experiment.block)
    student = assembly.learner(experiment)
    weights, sigma = student.weights(), student.sigma
    rollout = worker.rollout(weights, 0, experiment.horizon, sigma)
    spent: list[tuple[float, float]] = []

    def act() -> None:
        before = time.process_time()
        made = worker.rollout(weights, 0, experiment.horizon, sigma)
        whole = time.process_time() - before
        shares = made.seconds["policy"] / sum(made.seconds.values())
        spent.append((whole * (1.0 - shares), whole * shares))

    _repeat(act, seconds / 3)
    world_s = median(world for world, _ in spent) / rollout.samples
    act_s = median(policy for _, policy in spent) / rollout.samples / act_flop(fleet)
    update = _repeat(lambda: student.update(rollout, rollout.rewards, sigma), seconds / 3)
    student.close()
    cores = min(2, experiment.ppo.threads)
    costs = replace(
        Costs(),
        world_s=world_s,
        act_s=act_s,
        update_s=update * cores / rollout.samples / update_flop(fleet),
    )
    if not fleet.style:
        return costs
    judge = assembly.discriminator(experiment)
    times: tuple[list[float], list[float]] = [], []
    batch = 0

    def style() -> None:
        nonlocal batch
        began = time.perf_counter()
        scores = judge.score(
            batch, rollout.states, rollout.end_index, rollout.end_states, rollout.valid
        )
        scored = time.perf_counter()
        judge.train(scores.version)
        times[0].append(scored - began)
        times[1].append(time.perf_counter() - scored)
        batch += 1

    _repeat(style, seconds / 3)
    return replace(costs, score_s=min(times[0]) / rollout.samples, train_s=min(times[1]))


def _repeat(function: Callable[[], object], seconds: float) -> float:
    """Call a function for some seconds, at least three times; return its shortest time, s."""
    function()  # allocations
    shortest, count, end = float("inf"), 0, time.perf_counter() + seconds
    while count < 3 or time.perf_counter() < end:
        began = time.perf_counter()
        function()
        shortest, count = min(shortest, time.perf_counter() - began), count + 1
    return shortest
