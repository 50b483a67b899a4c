"""The display's figures and its time to go."""

import io

import pytest
from rich.console import Console

from console.training.display import Goal, block, open_display, remaining, stage


def test_time_to_go_follows_the_nearest_limit():
    goal = Goal(iterations=100, samples=1000)
    metrics = {"iteration": 10.0, "samples": 500.0, "seconds": 30.0}
    # Half of the samples in 30 s: half a minute to go, though 90 iterations are left.
    assert remaining(goal, metrics, (0.0, 0.0)) == "0:30"
    assert remaining(Goal(), metrics, (0.0, 0.0)) == "-"
    # ten minutes more, of which one is over, in a run that had counted an hour
    timed = Goal(seconds=600.0).after(3600.0)
    since = (timed.fraction(0, 0, 3600.0), 3600.0)
    assert remaining(timed, {"seconds": 3660.0}, since) in ("8:59", "9:00")


@pytest.mark.parametrize("terminal", [True, False])
def test_display_names_every_figure(terminal, tmp_path):
    with (tmp_path / "screen").open("w+") as file:
        console = Console(file=file, force_terminal=terminal, width=200)
        metrics = {
            "iteration": 3.0,
            "samples": 3e6,
            "seconds": 5.0,
            "reward/task": 0.5,
            "reward/style": 0.25,
            "ppo/kl": 0.0123,
            "style/accuracy_mocap": 0.875,
        }
        with open_display("sit", Goal(iterations=9), console) as display:
            display.show(metrics)
        file.seek(0)
        shown = file.read()
    for figure in ("3.0", "0.500", "0.250", "0.0123", "87.5%"):
        assert figure in shown


@pytest.mark.parametrize("done", [0.0, 30.0, 100.0])
@pytest.mark.parametrize("width", [60, 80, 200])
def test_the_bar_has_a_row_of_its_own(done: float, width: int) -> None:
    """Behind a bar that is full the samples per second would be cropped."""
    console = Console(width=width, record=True, file=io.StringIO(), force_terminal=True)
    figures = {"iteration": done, "rate/samples_per_s": 8219.0}
    console.print(block("sit", Goal(iterations=100), figures, "1:00"))
    lines = console.export_text().splitlines()
    rate = next(line for line in lines if "samples/s" in line)
    assert rate.startswith("rate") and "8,219 samples/s" in rate
    assert all(len(line) <= width for line in lines)


def test_the_stage_names_the_iteration_at_hand_and_the_time_left() -> None:
    assert stage(Goal(), {}, "-") == "iteration 1"
    done = {"iteration": 4.0, "samples": 100.0}
    assert stage(Goal(iterations=10), done, "0:30") == "iteration 5, 40% done, to go 0:30"
    for terminal in (True, False):
        console = Console(file=io.StringIO(), force_terminal=terminal, width=200)
        with open_display("sit", Goal(iterations=10), console) as display:
            assert display.stage() == "iteration 1, 0% done, to go -"
            display.show(done | {"seconds": 20.0})
            assert display.stage() == "iteration 5, 40% done, to go -"
            display.show({"iteration": 7.0, "seconds": 35.0})
            assert display.stage() == "iteration 8, 70% done, to go 0:15"
