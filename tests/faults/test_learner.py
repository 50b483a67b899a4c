"""The learner SIGKILLed at random moments and resumed: the bits of a run that never was."""

from pathlib import Path

import pytest

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
