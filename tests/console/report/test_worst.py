"""The worst trials: which they are, that they are simulated as before, and the page of them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.evaluation import trials
from console.evaluation.command import objects_of
from console.evaluation.stepping import BLOCK
from console.run import assembly
from tests.support.console.runs import said
from tests.support.console.trials import standing
from world.config import WorldConfig
from world.scene import perturbations
from world.tasks import make


def test_chosen_trials_are_simulated_as_among_the_others() -> None:
    """Bit for bit, with the numbers of their balls, by a policy that acts on them."""
    found = assembly.trained(Path("walk"))
    what = perturbations.draw("projectiles", 160, 3, 40)
    every = trials.manifest(objects_of(found, "test", 160, 3), 160, 3, disturbance=what)
    whole = trials.run(found.experiment.world, found.weights, every, 40, 2)
    rows = [159, 3, 130, 64, 63]
    padded = [*rows, *[rows[0]] * (BLOCK - len(rows))]
    part = trials.run(found.experiment.world, found.weights, every.chosen(padded), 40, 1, 5)
    assert np.array_equal(part.error_m[:5], whole.error_m[rows])
    assert np.array_equal(part.fell_at[:5], whole.fell_at[rows])
    assert [track.take.meta["trial"] for track in part.tracks] == rows
    assert len(np.unique(whole.error_m[:, 0])) > 100, "trials differ"


def test_chosen_boxes_have_the_stands_and_targets_of_their_numbers() -> None:
    world = WorldConfig(task="carry")
    boxes = make("carry").affordance.trial_pieces("test", 40, 0, world)
    every = trials.manifest(boxes, 40, 0)
    whole = trials.drive(world, standing, every, 2, 1)
    part = trials.drive(world, standing, every.chosen([39, 7]), 2, 1)
    assert np.array_equal(part.error_m, whole.error_m[[39, 7]])


def test_the_page_has_the_worst_trials_and_what_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page, figures = tmp_path / "worst.html", tmp_path / "figures.json"
    asked = ["evaluate", "walk", "--trials", "24", "--quality", "0", "--seed", "100"]
    more = ["--worst", "4", "--out", str(page), "--json", str(figures), "--perturb", "moved"]
    assert main([*asked, *more]) == 0
    assert "the worst 4 of 24 trials" in capsys.readouterr().out
    text = page.read_text()
    takes = json.loads(re.findall(r'id="takes">(.*?)</script>', text, re.DOTALL)[0])
    assert len(takes) == 4 and text.count("data-take=") == 4
    for take in takes:
        assert take["hz"] == 15 and take["frames"] == len(take["error"]) and take["poses"]
    rate = json.loads(figures.read_text())["success"]["rate"]
    failed = round(24 * (1 - rate))
    told = [take["about"] for take in takes]
    assert sum("never nearer" in about for about in told) == min(4, failed)
    cells = re.findall(r"<td>floor</td><td>24</td><td>(\d+)</td><td>(\d+)</td>", text)
    assert sum(map(int, cells[0])) == failed


def test_the_flags_belong_together(capsys: pytest.CaptureFixture[str]) -> None:
    for more in (["--worst", "3"], ["--out", "x.html"]):
        assert main(["evaluate", "walk", "--trials", "2", *more]) == 2
        assert "--worst and --out belong together" in said(capsys)
