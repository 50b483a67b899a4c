"""The evaluation's protocol against geometry: who stands still, who is put onto the seat."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from console.commands import Evaluate
from console.evaluation import trials
from console.evaluation.command import distances, manifest_of, scored
from console.evaluation.presets import published
from console.evaluation.scores import Protocol, judge
from console.evaluation.stepping import Trials
from console.evaluation.tables import results_table
from world import tasks
from world.character import model as character
from world.character import servos
from world.config import WorldConfig
from world.errors import ChoiceError
from world.furniture.catalogue import catalogue
from world.objects.furniture_bank import scaled
from world.scene import perturbations
from world.scene.batch import Scenes
from world.tasks import Target
from world.tasks.sit import HIP_ABOVE_SEAT_M, Sit

WORLD = WorldConfig()
STAND = torch.from_numpy(character.standing_qpos())
#: A second and a half to succeed, half a second to hold.
SHORT = Protocol(success_m=3.0, limit_s=1.5, hold_s=0.5)


def standing(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """Hold the servos at the standing pose."""
    scenes.batch.bind("ctrl")[:] = servos.coordinates(STAND[None]).numpy()
    scenes.batch.step(nstep=character.SUBSTEPS)


def teleported(scenes: Scenes, state: Tensor, goal: Tensor, place: Target) -> None:
    """An oracle: the hip is where it should be, the thighs level."""
    qpos = STAND.repeat(scenes.n, 1)
    qpos[:, :3] = Sit().hip(place)
    for joint in ("right_hip", "left_hip"):
        address = int(scenes.models[0].joint(joint).qposadr[0])
        qpos[:, address : address + 4] = torch.tensor([0.5**0.5, 0.0, -(0.5**0.5), 0.0])
    scenes.qpos[:] = qpos


def geometry(chosen: Trials) -> np.ndarray:
    """Distance of a standing hip from its target in each trial, m."""
    heights = np.array(
        [
            scaled(piece, float(s)).sit[0].point_m[2]
            for piece, s in zip(chosen.pieces, chosen.scale, strict=True)
        ]
    )
    up = heights + HIP_ABOVE_SEAT_M - character.standing_qpos()[2]
    return np.hypot(chosen.distance_m, up)


def test_who_stands_still_scores_what_geometry_says() -> None:
    chosen = trials.manifest(catalogue("test"), 64, 0)
    results = trials.drive(WORLD, standing, chosen, SHORT.steps, 2)
    far = geometry(chosen)
    # a stand sways by centimetres: the first second stays within 3 cm of it
    assert np.abs(results.error_m[:, :30] - far[:, None]).max() < 0.03
    clear = np.abs(far - SHORT.success_m) > 0.05
    outcomes = judge(results.error_m, results.fell_at, SHORT)
    assert np.array_equal(outcomes.success[clear], (far < SHORT.success_m)[clear])
    assert 0.1 < outcomes.success.mean() < 0.4
    assert np.nanmax(outcomes.time_s) < 1.5 and np.nanmedian(outcomes.time_s) == 1 / 30
    # by the paper's 20 cm nobody succeeds who starts a metre away
    figures = scored(results, chosen, Protocol(limit_s=1.5, hold_s=0.5), Sit.stages)
    assert figures["success"]["rate"] == 0.0 and figures["precision_m"] is None
    assert [part["success"] for part in figures["by_distance"]] == [0.0] * 3
    assert sum(part["trials"] for part in figures["by_object"]) == 64


def test_an_oracle_scores_all() -> None:
    chosen = trials.manifest(catalogue("test"), 48, 0)
    protocol = Protocol(limit_s=1.0, hold_s=0.5)
    results = trials.drive(WORLD, teleported, chosen, protocol.steps, 1)
    figures = scored(results, chosen, protocol, Sit.stages)
    assert figures["success"]["rate"] == 1.0 and figures["sustained"]["rate"] == 1.0
    assert figures["success"]["ci95"][0] == pytest.approx(48 / (48 + 1.96**2), abs=1e-3)
    assert figures["time_s"] == pytest.approx(1 / 30)
    assert figures["precision_m"] < 1e-4 and figures["falls"] == 0.0
    assert figures["by_stage"][-1]["stage"] == "held"
    assert figures["by_stage"][-1]["rate"] == 1.0


def command(**flags: object) -> Evaluate:
    return replace(Evaluate(Path("x")), **flags)


@pytest.mark.parametrize("kind", ["projectiles", "moved"])
def test_disturbed_trials_do_not_depend_on_threads_or_number(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trials, "CHUNK", 16)
    pieces, protocol = catalogue("test"), Protocol(limit_s=2.0, hold_s=0.2)
    many = manifest_of("sit", pieces, command(trials=40, perturb=kind), protocol, (0.8, 1.2))
    few = manifest_of("sit", pieces, command(trials=20, perturb=kind), protocol, (0.8, 1.2))
    assert np.array_equal(many.distance_m[:20], few.distance_m)
    assert torch.equal(many.disturbance.step[:20], few.disturbance.step)
    assert torch.equal(many.disturbance.draw[:20], few.disturbance.draw)
    one = trials.drive(WORLD, standing, many, 24, 1)
    two = trials.drive(WORLD, standing, many, 24, 2)
    assert np.array_equal(one.error_m, two.error_m)
    assert np.array_equal(one.disturbed, two.disturbed)


def test_presets_and_published_rows() -> None:
    assert distances(command(), "sit") == (1.0, 10.0)
    assert distances(command(preset="table3"), "sit") == (1.0, 5.0)
    assert distances(command(preset="table3", far_m=2.0), "sit") == (1.0, 2.0)
    assert [row.success for row in published("lie", "table1", "none")] == [90.2]
    assert [row.success for row in published("lie", "table1", "moved")] == [82.0]
    assert published("sit", "table3", "none")[0].time_s == 3.7
    assert published("juggle", "table1", "none") == ()
    with pytest.raises(ChoiceError, match="moved, none, projectiles"):
        perturbations.draw("rain", 1, 0, 100)


def test_the_paper_stands_beside_ours() -> None:
    chosen = trials.manifest(catalogue("test"), 6, 0)
    protocol = Protocol(limit_s=0.2, hold_s=0.1)
    results = trials.drive(WORLD, teleported, chosen, protocol.steps, 1)
    figures = {
        "task": "sit", "trials": 6, "objects": "test", "perturbation": "none",
        "preset": "table1", "start_m": [1.0, 10.0], "wall_s": 1.0,
        **scored(results, chosen, protocol, tasks.make("sit").stages),
    }  # fmt: skip
    table = results_table(figures)
    names = list(table.columns[0].cells)
    assert names[:2] == ["all", "paper"] and "held" in names
    assert list(table.columns[1].cells)[:2] == ["100.0", "90.4"]
