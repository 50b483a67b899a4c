"""Where a policy that walks comes to boxes: the states from which a tracker is to take them up."""

from collections.abc import Callable
from pathlib import Path

import torch

from console.run.experiment import Experiment
from console.run.policy_teachers import Trained, beginning
from policy.model.acting import Policy
from world import tasks
from world.config import InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.motions import load
from world.tasks.walk import Walk
from world.teachers.arriving import WatchedWalker
from world.teachers.walker import WalkerTeacher
from world.tracking.arrivals import Arrivals

#: Characters that walk, for so many control steps; half of them with action noise.
_SCENES, _STEPS, _NOISE = 128, 360, 0.03
#: Each walks to a box from near, with little way to turn, or from farther off, m.
_NEAR_M, _FAR_M = (0.8, 1.8), (1.8, 4.0)


def walker_of(experiment: Experiment, trained: Callable[[Path], Trained]) -> Trained | None:
    """Return the walker from whose arrivals an experiment's tracking begins; None without.

    trained: reads a run, checkpoint or name. Raises ConfigError for a policy of another task, or
    of other actions; and as `trained`.
    """
    source = experiment.world.track.walker
    return beginning("--world.track.walker", source, Walk.name, experiment, trained)


def arrivals_of(experiment: Experiment, trained: Callable[[Path], Trained]) -> Arrivals | None:
    """Return the states in which an experiment's walker comes to boxes; None without one. Raises as
    walker_of."""
    found = walker_of(experiment, trained)
    if found is None:
        return None
    return watched(Policy(found.weights), found.experiment.world, experiment.seed)


def watched(policy: Policy, world: WorldConfig, seed: int) -> Arrivals:
    """Return the states in which a walking policy comes to boxes on stands, among the package's own
    clips and sizes; world: that of its training, of whose actions it is."""
    near = InitialStates(0.0, 0.6, 0.4, near_m=_NEAR_M, far_m=_FAR_M, standing_fraction=0.6)
    config = WorldConfig(
        task="carry",
        episode_s=6.0,
        initial=near,
        action_scale=world.action_scale,
        action_clip=world.action_clip,
    )
    use = tasks.make(config.task).affordance
    library = load.cached_library((), True, use.clips, ())
    watch = WatchedWalker(WalkerTeacher(policy), _SCENES)
    shard = Shard(config, library, use.bank(config), range(_SCENES), seed, watch)
    random = torch.Generator().manual_seed(seed)
    noise = _NOISE * (torch.arange(_SCENES) % 2 == 0)[:, None]
    for _ in range(_STEPS):
        label = shard.label()
        assert label is not None, "the shard has a teacher"
        action = torch.where(label.isnan(), 0.0, label)
        shard.step(action + noise * torch.randn(action.shape, generator=random))
    return watch.arrivals()
