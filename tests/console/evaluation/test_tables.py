"""Tables: the paper stands beside ours."""

from console.evaluation import trials
from console.evaluation.command import scored
from console.evaluation.scores import Protocol
from console.evaluation.tables import results_table
from tests.support.console.trials import teleported
from world import tasks
from world.config import WorldConfig
from world.furniture.catalogue import catalogue

WORLD = WorldConfig()


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
