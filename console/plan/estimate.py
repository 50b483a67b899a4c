"""Estimates of a fleet: rates, bytes, memory, cost, and the part that limits them.

The formulas are those of docs/how-to/cluster-scaling.md. `inhabit bench scaling` compares them with
what it measures.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from world.character.features import STATE
from world.character.model import NU

#: Bytes of a number.
_FLOAT = 4
#: A sample in a rollout besides state, goal, action and mean: log-probability, reward (float32),
#: three flags.
_REST_BYTES = 2 * _FLOAT + 3
#: Copies of a rollout that the learner holds at once: parts, joined, normalised, the batch.
_COPIES = 4
#: Resident memory of a process before its scenes and networks: learner with style, actor, bytes
#: (measured: docs/results/throughput.md).
_LEARNER_BYTES, _ACTOR_BYTES, _SCENE_BYTES = 620e6, 500e6, 50e3
#: Networks in the learner: actor, its average, critic, two Adam moments of actor and critic, and
#: one gradient of each.
_NETWORK_COPIES = 9
#: Floating-point operations of a weight in a pass forward, and in one forward and backward.
_FORWARD, _BOTH = 2, 6


@dataclass(frozen=True)
class Costs:
    """What a sample and a part cost, s of a core. The defaults are those of two quiet cores and the
    task sit (docs/results/throughput.md)."""

    world_s: float = 105e-6
    """A control step of a scene: simulator, resets, features, rewards."""
    act_s: float = 2.3e-11
    """A floating-point operation of acting."""
    update_s: float = 4.5e-12
    """A floating-point operation of an update."""
    score_s: float = 2.5e-6
    """Scoring a transition, in the learner's process."""
    train_s: float = 0.028
    """A training of the discriminator, beside the update: its gradient steps are the same for any
    number of scenes."""
    part_s: float = 0.771e-3
    """Receiving a part: the rollout of one actor."""
    receive_s: float = 0.4935e-6
    """Receiving a sample of it."""


@dataclass(frozen=True)
class Fleet:
    """What is planned."""

    actors: int
    """Rollout workers, each with a core of its own."""
    scenes: int
    """Scenes over all actors."""
    horizon: int
    """Control steps of a scene in an iteration."""
    epochs: int
    """Epochs of an update."""
    hidden: tuple[int, ...]
    """Hidden widths of actor and critic."""
    goal: int
    """Width of the task's goal."""
    style: bool = True
    """The reward has a style term; its service has a core of its own."""
    replay: int = 200_000
    """Transitions in the discriminator's replay."""
    overlap: bool = False
    """Actors act while the learner updates."""
    learner_cores: int = 2
    """Cores of the learner; more than 2 are not used."""
    gbit_per_s: float = 10.0
    """Network of the learner's node."""

    @property
    def samples(self) -> int:
        """Samples of an iteration."""
        return self.scenes * self.horizon

    @property
    def weights(self) -> int:
        """Weights of the actor."""
        widths = (STATE.width + self.goal, *self.hidden, NU)
        return sum((a + 1) * b for a, b in pairwise(widths))

    @property
    def sample_bytes(self) -> int:
        """Bytes of a sample on its way to the learner: state, goal, action and mean."""
        return _FLOAT * (STATE.width + self.goal + 2 * NU) + _REST_BYTES


@dataclass(frozen=True)
class Estimate:
    """The estimate of a fleet."""

    rollout_s: float
    """Time of an actor's rollout."""
    intake_s: float
    """Time in which the learner takes in the parts of all actors, or the network transports
    them."""
    style_s: float
    """Time of scoring, and by which the discriminator's training is longer than the update."""
    update_s: float
    iteration_s: float
    samples_per_s: float
    ideal_samples_per_s: float
    """If actors alone took time."""
    to_ideal: float
    rollout_bytes: float
    """Of all actors, an iteration."""
    weight_bytes: float
    """Of the weights, once to each node an iteration."""
    network_bytes_per_s: float
    learner_memory_bytes: float
    actor_memory_bytes: float
    """Of each."""
    bottleneck: str
    """The part that takes the most time: actors, network, intake, style or update."""


def estimate(fleet: Fleet, costs: Costs) -> Estimate:
    """Estimate rates, bytes and memory of a fleet."""
    n = fleet.samples
    each = -(-fleet.scenes // fleet.actors)  # the actor with the most scenes
    step_s = costs.world_s + act_flop(fleet) * costs.act_s
    rollout_s = each * fleet.horizon * step_s
    rollout_bytes = float(n * fleet.sample_bytes)
    weight_bytes = float(_FLOAT * fleet.weights)
    wire_s = 8 * rollout_bytes / (fleet.gbit_per_s * 1e9)
    receive_s = fleet.actors * costs.part_s + n * costs.receive_s
    intake_s = max(wire_s, receive_s)
    cores = min(2, fleet.learner_cores)  # actor beside critic
    update_s = n * update_flop(fleet) * costs.update_s / cores
    style_s = 0.0
    if fleet.style:  # the training runs beside the update, on another core
        style_s = n * costs.score_s + max(0.0, costs.train_s - update_s)
    learning_s = intake_s + style_s + update_s
    whole = max(rollout_s, learning_s) if fleet.overlap else rollout_s + learning_s
    parts = {
        "actors": rollout_s,
        "network" if wire_s > receive_s else "intake": intake_s,
        "style": style_s,
        "update": update_s,
    }
    critic = fleet.weights  # about the same
    networks = _FLOAT * _NETWORK_COPIES * 0.5 * (fleet.weights + critic)
    replay = _FLOAT * 2 * STATE.width * fleet.replay if fleet.style else 0
    return Estimate(
        rollout_s=rollout_s,
        intake_s=intake_s,
        style_s=style_s,
        update_s=update_s,
        iteration_s=whole,
        samples_per_s=n / whole,
        ideal_samples_per_s=n / rollout_s,
        to_ideal=rollout_s / whole,
        rollout_bytes=rollout_bytes,
        weight_bytes=weight_bytes,
        network_bytes_per_s=(rollout_bytes + weight_bytes) / whole,
        learner_memory_bytes=_LEARNER_BYTES
        + (_COPIES + fleet.overlap) * rollout_bytes
        + networks
        + replay,
        actor_memory_bytes=_ACTOR_BYTES + each * _SCENE_BYTES + weight_bytes,
        bottleneck=max(parts, key=lambda name: parts[name]),
    )


def update_flop(fleet: Fleet) -> int:
    """Return the floating-point operations of an update, for a sample: actor and critic."""
    return 2 * fleet.epochs * _BOTH * fleet.weights


def act_flop(fleet: Fleet) -> int:
    """Return the floating-point operations of an action."""
    return _FORWARD * fleet.weights


def best_actors(fleet: Fleet, costs: Costs, block: int, share: float = 0.9) -> int:
    """Return the smallest number of actors that gives at least `share` of the greatest rate that
    any number of actors gives to these scenes, in whole blocks."""
    most = max(1, fleet.scenes // block)
    rates = [
        estimate(replace(fleet, actors=count), costs).samples_per_s for count in range(1, most + 1)
    ]
    return first_above(rates, share * max(rates)) + 1


def first_above(values: Sequence[float], least: float) -> int:
    """Return the index of the first value that is at least `least`."""
    return next(index for index, value in enumerate(values) if value >= least)
