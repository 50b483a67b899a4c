"""A scene that goes NaN: its sample is void, the others and the training do not notice."""

from pathlib import Path
from typing import Any

import pytest
import torch

from actors.cluster import ray_session
from console.recording.format import read
from console.run import assembly
from console.run.experiment import Experiment
from discriminator.config import StyleConfig
from learner.config import LearnerConfig
from tests.support import small_clips
from tests.support.console.trainings import assert_same, everything, lines, opened
from tests.support.poisoned_shard import MakePoisoned
from world.config import WorldConfig

SOUND = assembly.make_shard


@pytest.fixture(scope="module")
def experiment(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    """Two blocks of 16 scenes, six steps an iteration; scene 20 breaks in the second."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    return Experiment(
        seed=3,
        scenes=32,
        block=16,
        horizon=6,
        world=WorldConfig(motions=(str(clips),), pieces=3, scales=1, episode_s=1.0),
        ppo=LearnerConfig(hidden=(32, 16), minibatch=96, warmup_iterations=1),
        style=StyleConfig(
            hidden=(32, 16), batch=64, penalty_batch=32, replay=400, normaliser_samples=500
        ),
    )


@pytest.fixture
def poisoned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every fleet that is opened has the poisoned scene."""
    monkeypatch.setattr(assembly, "make_shard", lambda *given: MakePoisoned(SOUND(*given)))


def trained(
    experiment: Experiment, folder: Path, **how: Any
) -> tuple[dict[str, Any], list[dict[str, float]], int]:
    """State, metrics and rows scored by the style of three iterations."""
    with opened(experiment, folder, 3, **how) as loop:
        loop.run()
        state = everything(loop.state_dict())
        return state, lines(loop), int(state["style/counters~1transitions"])


def test_one_sample_is_dropped_and_counted_on_both_runners(
    experiment: Experiment, poisoned: None, tmp_path: Path
) -> None:
    state, metrics, scored = trained(experiment, tmp_path / "local")
    assert [line["dropped/samples"] for line in metrics] == [0, 1, 0]
    assert [line["samples"] for line in metrics] == [192, 384, 576]
    assert scored == 576 - 1, "the discriminator has seen all the others, once"
    assert all(v.isfinite().all() for v in state.values() if isinstance(v, torch.Tensor))
    assert [p.name for p in (tmp_path / "local" / "recordings").iterdir()] == [
        "broken-20-9.msgpack"
    ]
    box = read(tmp_path / "local" / "recordings" / "broken-20-9.msgpack")
    assert box.meta["scene"] == 20 and box.meta["clock"] == 9
    with ray_session(cpus=2, object_store_bytes=100 * 2**20):
        there = trained(experiment, tmp_path / "ray", runner="ray", workers=2)
    assert_same(there[0], state)
    assert there[1] == metrics


def test_the_other_scenes_have_the_bits_of_an_undisturbed_rollout(
    experiment: Experiment, tmp_path: Path
) -> None:
    from actors.local import LocalFleet
    from console.run.directory import RunDirectory

    sound = SOUND(experiment, RunDirectory(tmp_path))
    learner = assembly.learner(experiment)
    got = []
    for make in (sound, MakePoisoned(sound, victim=7, at=3)):
        fleet = LocalFleet(make, 32, 16, 1, seed=3, horizon=6)
        got.append(fleet.collect(learner.weights(), 0, 0.1))
        fleet.close()
    learner.close()
    undisturbed, disturbed = got
    assert (~disturbed.valid).nonzero().tolist() == [[2, 7]] and undisturbed.valid.all()
    others = torch.arange(32) != 7
    for name in ("states", "actions", "rewards", "log_probs", "fell", "timed_out"):
        one, other = getattr(undisturbed, name), getattr(disturbed, name)
        assert torch.equal(one[:, others], other[:, others]), name
        # until the step that broke it, the scene itself as well
        assert torch.equal(one[:2, 7], other[:2, 7]), name
    assert disturbed.states.isfinite().all(), "it begins anew"
    assert not torch.equal(undisturbed.states[3:, 7], disturbed.states[3:, 7])
