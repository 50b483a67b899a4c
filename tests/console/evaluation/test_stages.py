"""Success by stage: what sit's stages are, and how they come from the shard into the metrics; and
that a scene that blows up while carrying is written down with its box."""

import math
from pathlib import Path

import numpy as np
import pytest
import torch

from console.recording import format as recording
from console.run.nan_dump import NanDump
from learner.episodes import EpisodeWindow
from world.character import features
from world.character import model as character
from world.config import CarryConfig, InitialStates, WorldConfig
from world.episodes.shard import Shard
from world.motions.library import MotionLibrary
from world.motions.synthetic import library as synthetic
from world.motions.uses.box import BOX
from world.objects.box_bank import BoxBank, boxes
from world.tasks import REGISTRY, Target, make
from world.tasks.sit import HIP_ABOVE_SEAT_M, Sit


def body_at(x: float, y: float, z: float) -> features.Body:
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].clone()
    qpos[0, :3] = torch.tensor([x, y, z])
    return features.body(qpos, torch.zeros(1, character.NV))


def test_stages_of_sit() -> None:
    corners = torch.tensor(
        [[x, y, z] for x in (-0.25, 0.25) for y in (-0.2, 0.2) for z in (0.0, 0.9)]
    )[None]
    seat = Target(torch.tensor([[0.0, 0.0, 0.43]]), torch.tensor([[1.0, 0.0]]), corners)
    on = 0.43 + HIP_ABOVE_SEAT_M
    assert Sit.stages == ("approached", "touched", "seated")
    for where, expected in (
        ((3.0, 0.0, 0.88), [False, False, False]),
        ((0.6, 0.0, 0.88), [True, False, False]),
        ((0.25, 0.0, on), [True, True, False]),
        ((0.05, 0.0, on + 0.12), [True, False, True]),
        ((0.0, 0.0, on), [True, True, True]),
    ):
        assert Sit().stage(body_at(*where), seat)[0].tolist() == expected, where


@pytest.mark.parametrize("name", sorted(REGISTRY))
def test_every_task_names_its_stages(name: str) -> None:
    task = make(name)
    assert task.name == name
    assert len(set(task.stages)) == len(task.stages) >= 3
    ends = [stage.startswith("end_") for stage in task.stages]
    assert task.stages[0] == "approached" or all(ends)
    assert task.episode_s in (10.0, 15.0)


def test_stages_are_logged_over_the_last_episodes() -> None:
    window = EpisodeWindow(4)
    ended = {key: torch.zeros(2) for key in ("return", "length", "success", "fall", "start")}
    window.add(ended | {"stage_seen": torch.tensor([1.0, 0.0])})
    assert window.metrics()["episode/stage_seen"] == pytest.approx(0.5)
    window.add(ended | {"stage_seen": torch.tensor([1.0, 1.0])})
    assert window.metrics()["episode/stage_seen"] == pytest.approx(0.75)
    window.add(ended | {"stage_seen": torch.tensor([0.0, 0.0])})
    assert window.metrics()["episode/stage_seen"] == pytest.approx(0.5)
    # a run that was begun before there were stages: they count from then on
    older = EpisodeWindow(4)
    older.load_state_dict(ended)
    older.add(ended | {"stage_seen": torch.tensor([1.0, 1.0])})
    assert older.metrics()["episode/stage_seen"] == 1.0
    assert math.isfinite(older.metrics()["episode/success"])


def test_stages_and_a_blow_up_of_carry(tmp_path: Path) -> None:
    walking = [synthetic.walking(np.random.default_rng(0), 1.0)]
    config = WorldConfig(task="carry", initial=InitialStates(0, 1, 0), episode_s=0.5)
    bank = BoxBank(boxes(CarryConfig(sizes=4)))
    shard = Shard(config, MotionLibrary(walking, use=BOX), bank, range(32), 0)
    kept = NanDump(shard, range(32), bank.pieces, tmp_path)
    found: list[torch.Tensor] = []
    for _ in range(15):
        step = kept.step(torch.zeros(32, 28))
        found.append(step.episodes["stage_lifted"])
    assert len(torch.cat(found)) >= 32
    assert not torch.cat(found).any()
    shard._scenes.qvel[3, 10] = 1e6
    assert not kept.step(torch.zeros(32, 28)).finite[3]
    (file,) = tmp_path.iterdir()
    take = recording.read(file).takes[0]
    assert take.qpos.shape[1] == character.NQ + 7
    assert take.cargo.tolist() == pytest.approx(bank.pieces[0].boxes[0].half_m, rel=1.0)
    model = recording.model_of(take)
    assert model.nq == character.NQ + 7
