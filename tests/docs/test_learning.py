"""The section on returns by samples: rows by hand, at any stage of completion."""

import json
from typing import Any

from console.bench.peers.curves import Run, Window, figures_of
from console.bench.peers.learning import LEARNERS
from docs.generate import hook, learning


def run(name: str, seed: int, mean_return: float) -> Run:
    """A curve of ten windows whose returns are the same."""
    windows = tuple(
        Window(1_000_000 * (k + 1), 1000, 250.0, 4, 4 * mean_return, 3, 2.0) for k in range(10)
    )
    return Run(name, seed, "2.1.1", windows)


def result(*runs: Run) -> dict[str, Any]:
    return {
        "plan": {"samples": 10_000_000},
        "seeds": 3,
        "runs": [one.to_json() for one in runs],
        "threads": 2,
        "machine": {"cores": 2, "processor": "P", "versions": {"torch": "2", "mujoco": "3"}},
    }


def test_without_curves_the_page_says_so() -> None:
    page = learning.rendered({})
    assert "No training is complete yet" in page and "learning.json)" not in page
    assert "--samples 10000000 --seeds 3" in page


def test_rows_by_hand_and_what_is_missing() -> None:
    page = learning.rendered(result(run("skrl", 0, 10.0), run("skrl", 2, 13.0)))
    cell = "11.5 (10.0-13.0)"
    assert "|  | 2 M samples | 5 M samples | 10 M samples | seeds |" in page
    assert f"| skrl 2.1.1 | {cell} | {cell} | {cell} | 2 |" in page
    assert "| skrl 2.1.1 | 75 (75-75) | 75 (75-75) | 75 (75-75) | 2 |" in page
    assert "| skrl 2.1.1 | 0.250 (0.250-0.250) |" in page
    assert "Not complete yet: inhabit, seeds 0, 1, 2; rsl_rl, seeds 0, 1, 2; skrl, seed 1;" in page


def test_a_complete_comparison_says_so() -> None:
    page = learning.rendered(result(*(run(name, k, 1.0) for name in LEARNERS for k in range(3))))
    assert "All 18 trainings are complete." in page and "Not complete" not in page


def test_the_section_is_that_of_the_committed_curves() -> None:
    """Its figures are those of its curves: none is written by hand."""
    committed = json.loads(learning.FILE.read_text()) if learning.FILE.exists() else {}
    assert hook.pages()["results/peers.md"].endswith(learning.rendered(committed))
    if committed:
        runs = [Run.from_json(one) for one in committed["runs"]]
        assert figures_of(runs, committed["plan"]["samples"]) == committed["figures"]
