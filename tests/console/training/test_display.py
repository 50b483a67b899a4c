"""The display's figures, live and plain, and its time to go."""

import io

import pytest
from rich.console import Console

from console.training.display import open_display
from console.training.goal import Goal
from tests.support.console.recipes import FIVE


@pytest.mark.parametrize("terminal", [True, False])
def test_display_names_every_figure(terminal, tmp_path):
    stages = FIVE
    with (tmp_path / "screen").open("w+") as file:
        console = Console(file=file, force_terminal=terminal, width=200)
        metrics = {
            "iteration": 3.0,
            "samples": 3e6,
            "seconds": 5.0,
            "rate/samples_per_s": 8219.0,
            "episode/success_near": 0.412,
            "reward/task": 0.5,
            "reward/style": 0.25,
            "ppo/kl": 0.0123,
            "style/accuracy_mocap": 0.875,
            "style/logit_gap": 4.63,
            "style/skipped": 0.25,
            "recipe/stage": 2.0,
        }
        with open_display("sit", Goal(iterations=9), console, stages) as display:
            display.show(metrics)
        file.seek(0)
        shown = file.read()
    for figure in ("3.00 M", "8,219 samples/s", "to go -", "near 41.2% (wanted 40%)", "0.500",
                   "0.250", "0.0123", "mocap 87.5%", "logit gap 4.63", "throttled: 25% skipped",
                   "2 of 5"):  # fmt: skip
        assert figure in shown


def test_the_stage_follows_what_was_shown() -> None:
    done = {"iteration": 4.0, "samples": 100.0}
    for terminal in (True, False):
        console = Console(file=io.StringIO(), force_terminal=terminal, width=200)
        with open_display("sit", Goal(iterations=10), console) as display:
            assert display.stage() == "iteration 1, 0% done, to go -"
            display.show(done | {"seconds": 20.0})
            assert display.stage() == "iteration 5, 40% done, to go -"
            display.show({"iteration": 7.0, "seconds": 35.0})
            assert display.stage() == "iteration 8, 70% done, to go 0:15"
