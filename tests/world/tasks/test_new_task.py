"""A new task is one class and one registry line: it trains, evaluates, is shown and is served."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
import torch
from torch import Tensor

from console.app import main
from console.run.experiment import PRESETS
from console.serving import loading
from discriminator.config import StyleConfig
from learner.config import LearnerConfig
from rpc.v1 import policy_pb2 as pb
from tests.support import policy_cases, small_clips
from world import rotations, tasks
from world.affordances import FLOOR
from world.character import model as character
from world.character.features import STATE, Body, Feature, Table
from world.scene.target import Target
from world.tasks import Task


class Near(Task):
    """Be within a metre of a point."""

    name = "near"
    affordance = FLOOR
    goal = Table("goal", Feature("offset", 2, "root heading", "m"))
    terms: ClassVar[dict[str, float]] = {"closeness": 1.0}
    stages: ClassVar[tuple[str, ...]] = ("there",)
    success_m = 1.0

    def goal_features(self, body: Body, target: Target) -> Tensor:
        return rotations.turn_back(body.heading, (target.point - body.root)[:, :2])

    def reward_terms(self, body: Body, target: Target) -> Tensor:
        return torch.exp(-self.error_m(body, target))[:, None]

    def error_m(self, body: Body, target: Target) -> Tensor:
        return (target.point - body.root)[:, :2].norm(dim=1)

    def stage(self, body: Body, target: Target) -> Tensor:
        return (self.error_m(body, target) <= self.success_m)[:, None]

    def fell(self, body: Body, target: Target) -> Tensor:
        return body.root[:, 2] < 0.4


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """The registry line, and a preset small enough for a test."""
    monkeypatch.setitem(tasks.REGISTRY, "near", Near)
    small = replace(
        PRESETS["fast"],
        scenes=32,
        block=16,
        horizon=4,
        clone_passes=0,
        ppo=LearnerConfig(hidden=(16,), minibatch=64, warmup_iterations=1),
        style=StyleConfig(
            hidden=(16,), batch=32, penalty_batch=16, replay=200, normaliser_samples=300
        ),
    )
    monkeypatch.setitem(PRESETS, "fast", small)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    yield tmp_path_factory.mktemp("near")


@pytest.fixture
def run(folder: Path) -> Path:
    """A run of three iterations; made once."""
    path = folder / "run"
    if not path.exists():
        clips = small_clips.write(folder / "clips")
        words = ["train", "near", "--iterations", "3", "--actors", "1", "--threads", "1"]
        assert main([*words, "--run", str(path), "--motions", str(clips)]) == 0
    return path


def test_it_trains(run: Path) -> None:
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    assert [line["iteration"] for line in lines] == [1, 2, 3]
    assert all(0.0 < line["reward/closeness"] <= 1.0 for line in lines)


def test_it_is_evaluated(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "figures.json"
    words = ["evaluate", str(run), "--trials", "8", "--quality", "2", "--json", str(out)]
    assert main([*words, "--near-m", "0.5", "--far-m", "0.9"]) == 0
    figures = json.loads(out.read_text())
    # it starts within a metre: the first step is a success
    assert figures["task"] == "near" and figures["success"]["rate"] == 1.0
    assert [part["stage"] for part in figures["by_stage"]] == ["there", "held"]


def test_it_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "near", "--dry-run"]) == 0
    shown = capsys.readouterr().out
    assert "goal (policy and value function only): 2 numbers" in shown
    assert "offset" in shown and "reward of near" in shown and "closeness" in shown


def test_it_is_served(run: Path) -> None:
    source = loading.source("near", run, "latest")
    with policy_cases.running([source]) as server, policy_cases.stub(server) as stub:
        (policy,) = stub.Describe(pb.DescribeRequest()).policies
        assert policy.task == "near" and [(f.name, f.width) for f in policy.goal] == [("offset", 2)]
        state, goal = np.zeros(STATE.width, "<f4"), np.zeros(2, "<f4")
        reply = stub.Act(pb.ActRequest(task="near", state=state.tobytes(), goal=goal.tobytes()))
        action = np.frombuffer(reply.action, "<f4")
        assert action.shape == (character.NU,) and bool(np.isfinite(action).all())
        where = pb.Furniture(position=[1.0, 0.0, 0.0], rotation=[1.0, 0.0, 0.0, 0.0])
        asked = pb.SynthesizeRequest(task="near", seconds=0.2, furniture=where)
        frames = [part.frame for part in stub.Synthesize(asked) if part.HasField("frame")]
        assert frames[0].error_m == pytest.approx(1.0, abs=1e-4) and frames[0].success
