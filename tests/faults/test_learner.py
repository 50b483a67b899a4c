"""The learner SIGKILLed at random moments and resumed: the bits of a run that never was."""

from pathlib import Path

import pytest

from console.run.metrics import read_metrics
from tests.support.console.recipes import tiny
from tests.support.kill_learner import killed_and_resumed

pytestmark = pytest.mark.timeout(900)


# So many iterations that none comes to its end before it is killed: some take 10 ms.
@pytest.mark.parametrize(("runner", "kills", "iterations"), [("local", 2, 150), ("ray", 1, 60)])
def test_killed_and_resumed(runner: str, kills: int, iterations: int, tmp_path: Path) -> None:
    """`python -m tests.support.kill_learner --kills 50` at length: docs/results/faults.md."""
    found = killed_and_resumed(tmp_path, kills, iterations, seed=1, more=["--runner", runner])
    assert found.kills == kills
    assert (found.metrics_lines, found.samples) == (iterations, 64 * iterations)
    assert found.left_processes == 0, "the killed training leaves no process behind"


def test_killed_and_resumed_in_the_stages_of_a_recipe(tmp_path: Path) -> None:
    more = ["--recipe", str(tiny(tmp_path, iterations=50))]
    found = killed_and_resumed(tmp_path, 3, 1000, seed=4, more=more)
    assert found.kills == 3 and found.left_processes == 0
    assert (found.metrics_lines, found.samples) == (150, 64 * 150)
    lines = read_metrics(tmp_path / "killed" / "metrics.jsonl")
    assert [line["recipe/stage"] for line in lines] == [1.0] * 50 + [2.0] * 50 + [3.0] * 50
