"""What a trained tracker makes of the clips: physical states from which tracking may begin."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import cast

import torch

from console.run.experiment import Experiment
from console.run.policy_teachers import Trained, beginning, followers
from policy.model.acting import Policy
from world import tasks
from world.config import PerturbConfig, WorldConfig
from world.episodes.shard import Shard
from world.motions import load
from world.tasks.track import Track
from world.teachers.following import WatchedTracker
from world.tracking.bank import TrackBank
from world.tracking.rollouts import Rollouts

#: Characters that follow clips, for so many control steps; half of them with action noise.
_SCENES, _STEPS, _NOISE = 128, 600, 0.03


def tracker_of(experiment: Experiment, trained: Callable[[Path], Trained]) -> Trained | None:
    """Return the tracker in whose states an experiment's tracking begins; None without.

    trained: reads a run, checkpoint or name. Raises ConfigError for a policy of another task, or
    of other actions; and as `trained`.
    """
    source = experiment.world.track.rollouts
    return beginning("--world.track.rollouts", source, Track.name, experiment, trained)


def rollouts_of(
    experiment: Experiment,
    trained: Callable[[Path], Trained],
    bank: Callable[[WorldConfig], object],
) -> Rollouts | None:
    """Return the states in which an experiment's tracker went on; None without one. bank: of a
    world. Raises as tracker_of."""
    found = tracker_of(experiment, trained)
    if found is None:
        return None
    world = followers(experiment)[0]
    scenes = cast("TrackBank", bank(world))
    return watched(
        Policy(found.weights),
        found.experiment.world.track.residual,
        world,
        scenes,
        experiment.seed,
    )


def watched(
    policy: Policy, residual: bool, world: WorldConfig, bank: TrackBank, seed: int
) -> Rollouts:
    """Return the states from which a tracker went on, in the scenes of `world`, whose bank is
    `bank`; residual: its actions are added to the reference's set-points."""
    track = replace(world.track, residual=residual, goal="", teacher="", displaced_m=0.0)
    config = replace(world, track=track, perturb=PerturbConfig(), stall_s=None)
    use = tasks.make(config.task).affordance
    library = load.cached_library(config.motions, config.mirror, use.clips, config.playback_speeds)
    watch = WatchedTracker(policy, _SCENES, bank.each)
    shard = Shard(config, library, bank, range(_SCENES), seed, watch)
    random = torch.Generator().manual_seed(seed)
    noise = _NOISE * (torch.arange(_SCENES) % 2 == 0)[:, None]
    for _ in range(_STEPS):
        action = shard.label()
        assert action is not None, "the shard has a teacher"
        shard.step(action + noise * torch.randn(action.shape, generator=random))
    return watch.rollouts(seed)
