"""Both runners on real scenes: the same bits by threads, by Ray actors, and across a restart."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch

from actors.cluster import ray_session
from console.commands import Train
from console.commands.training import StyleAddress
from console.run.experiment import Experiment
from console.training.runners import require_shape
from discriminator.config import StyleConfig
from learner.config import LearnerConfig
from policy.checkpoints.format import flatten, read
from tests.support import small_clips
from tests.support.console.trainings import assert_same, everything, lines, opened
from world.config import WorldConfig
from world.errors import ConfigError

ITERATIONS = 3


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """Three blocks of 16 scenes, with episodes short enough to end within three iterations."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    return Experiment(
        seed=3,
        scenes=48,
        block=16,
        horizon=6,
        world=WorldConfig(motions=(str(clips),), pieces=3, scales=2, episode_s=1.0),
        ppo=LearnerConfig(hidden=(32, 16), minibatch=96, warmup_iterations=1),
        style=StyleConfig(
            hidden=(32, 16), batch=64, penalty_batch=32, replay=400, normaliser_samples=500
        ),
    )


@pytest.fixture(scope="module")
def alone(
    experiment: Experiment, tmp_path_factory: pytest.TempPathFactory
) -> tuple[dict[str, Any], list[dict[str, float]], Path]:
    """State, metrics and run directory of one worker in this process."""
    folder = tmp_path_factory.mktemp("alone")
    with opened(experiment, folder, ITERATIONS) as loop:
        start = {k: v.clone() for k, v in flatten(loop.learner.policy_state())[0].items()}
        loop.run()
        state = everything(loop.state_dict())
        assert sum(line["dropped/samples"] for line in lines(loop)) == 0
        assert loop.episodes.metrics()["episode/length"] > 0, "resets are part of the comparison"
        moved = [k for k, v in start.items() if not torch.equal(v, state[f"policy/{k}"])]
        assert any("actor" in k for k in moved), "the actor has learned in these iterations"
        return state, lines(loop), folder


def test_the_state_has_all_that_learns(alone: tuple[dict[str, Any], Any, Any]) -> None:
    names = [k for k, v in alone[0].items() if isinstance(v, torch.Tensor)]
    for part in ("policy/actor", "policy/normaliser", "critic", "exp_avg", "style/network"):
        assert any(part in name for name in names), (part, names)


@pytest.mark.parametrize("workers", [2, 3])
def test_threads_change_no_bit(
    workers: int, experiment: Experiment, alone: Any, tmp_path: Path
) -> None:
    with opened(experiment, tmp_path, ITERATIONS, workers=workers) as loop:
        loop.run()
        assert_same(everything(loop.state_dict()), alone[0])
        assert lines(loop) == alone[1]


@pytest.fixture(scope="module")
def cluster() -> Iterator[None]:
    """One Ray for all tests: a runner that finds one uses it."""
    with ray_session(cpus=3, object_store_bytes=100 * 2**20):
        yield


@pytest.mark.usefixtures("cluster")
@pytest.mark.parametrize("actors", [1, 2, 3])
def test_ray_and_the_service_change_no_bit(
    actors: int, experiment: Experiment, alone: Any, tmp_path: Path
) -> None:
    with opened(experiment, tmp_path, ITERATIONS, "ray", actors) as loop:
        loop.run()
        assert_same(everything(loop.state_dict()), alone[0])
        assert lines(loop) == alone[1]
        assert loop.fleet.alive() == actors
        # A checkpoint of the other runner, gone on with by this one.
        halfway = read(alone[2] / "checkpoints" / "000002").state
        loop.load_state_dict(halfway)
        loop.run()
        assert_same(everything(loop.state_dict()), alone[0])


@pytest.mark.usefixtures("cluster")
def test_without_a_style_reward_neither_runner_has_a_discriminator(
    experiment: Experiment, tmp_path: Path
) -> None:
    """Ray trained one all the same, whose state the local runner could not go on from."""
    plain = replace(experiment, ppo=replace(experiment.ppo, style_weight=0.0))
    with opened(plain, tmp_path / "local", ITERATIONS) as loop:
        loop.run()
        state, wanted = everything(loop.state_dict()), lines(loop)
    with opened(plain, tmp_path / "ray", ITERATIONS, "ray", 2) as loop:
        assert loop.style is None
        loop.run()
        assert_same(everything(loop.state_dict()), state)
        assert lines(loop) == wanted


def test_a_style_service_without_a_style_reward_is_refused(experiment: Experiment) -> None:
    plain = replace(experiment, ppo=replace(experiment.ppo, style_weight=0.0))
    command = Train(
        task="sit", experiment=plain, runner="ray", style_service=StyleAddress("host:1")
    )
    require_shape(command, experiment, 1)
    with pytest.raises(ConfigError, match=r"no style reward at --ppo\.style-weight 0"):
        require_shape(command, plain, 1)


def test_resumed_is_as_if_never_stopped(experiment: Experiment, tmp_path: Path) -> None:
    with opened(experiment, tmp_path / "whole", 4, workers=2) as loop:
        loop.run()
        whole, wanted = everything(loop.state_dict()), lines(loop)
    with opened(experiment, tmp_path / "split", 2) as loop:
        loop.run()
    with opened(experiment, tmp_path / "split", 4) as loop:
        loop.load_state_dict(read(tmp_path / "split" / "checkpoints" / "latest").state)
        loop.run()
        assert_same(everything(loop.state_dict()), whole)
        assert lines(loop) == wanted[2:]
    halves = [read(tmp_path / run / "checkpoints" / "latest").state for run in ("whole", "split")]
    assert_same(everything(halves[1]), everything(halves[0]))
    assert {name.partition("/")[0] for name in whole} == {"policy", "training", "style"}
