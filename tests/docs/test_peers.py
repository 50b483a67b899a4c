"""The page of `inhabit bench peers`: rows by hand, and the committed measurement."""

import json
from dataclasses import replace
from typing import Any

from console.bench.peers import pools
from console.bench.peers.figures import (
    FLEETS,
    OURS_FLEET,
    figures_of,
    fleet_figures,
    pool_figures,
)
from console.bench.peers.protocol import Turn
from console.bench.peers.registry import NAMES, OURS, OURS_TASK, SCENES
from docs.generate import hook, peers


def turns(samples: int, processor_s: float) -> list[Turn]:
    return [Turn(samples, 2.0, processor_s, 1, 0.5, 1.25)] * 3


def measured() -> dict[str, Any]:
    """A measurement of skrl alone: equal to the task alone in speed, with a quarter more processor
    time; of its 4 s the scenes take 2."""
    taken = {
        OURS: turns(800, 4.0),
        OURS_TASK: turns(1000, 3.2),
        SCENES: turns(1000, 2.0),
        "skrl": turns(1000, 4.0),
    }
    skrl = {"title": "skrl", "installed": "2.1.1", "code_lines": 90, "bf16": "", "normaliser": "x"}
    return {
        "figures": figures_of(taken),
        "turns": dict.fromkeys(taken),
        "peers": {"skrl": skrl | {"scenes": "workers"}},
        "machine": {
            "cores": 2, "processor": "P", "python": "3.11",
            "versions": {"torch": "2", "mujoco": "3"},
        },
        "rounds": 3, "turn_s": 6.0, "threads": 2, "load": [7.0, 8.25], "bf16": True,
    }  # fmt: skip


def test_rows_by_hand() -> None:
    page = peers.rendered(measured())
    assert "| skrl | 500 (500-500) | 4,000 (4,000-4,000) | 1.25 | 90 |" in page
    assert "| skrl | 1.00 (1.00-1.00) | 1.25 (1.25-1.25) | 0.80 (0.80-0.80) |" in page
    assert "Goal of 1.5 × the fastest, skrl: missed, 1.00 in samples/s and 1.25 in" in page
    # the scenes take 2 of inhabit's 3.2 s, and 2 of skrl's 4 s
    assert "62 % of inhabit's processor time and 50 % of that of skrl" in page
    assert "would be 2.00 × as fast as skrl" in page
    assert "Not measured: rsl_rl, torchrl, rllib." in page
    assert "The load of the machine was 7.0 and 8.2" in page
    assert "| skrl | 2.1.1 | nowhere | x | workers |" in page
    # a measurement of before the setting of RLlib's noise has no sigma
    assert "RLlib's noise began at 1" in page
    assert "RLlib's noise" not in peers.rendered(measured() | {"sigma": 0.05})
    quiet = peers.rendered(measured() | {"load": [0.61, 1.7]})
    assert (
        "The machine was quiet: its load was 0.6 before." in quiet
        and "other work shared" not in quiet
    )


def test_pools_have_a_section_where_they_were_measured() -> None:
    result = measured()
    assert "UniLab" not in peers.rendered(result)
    turn = Turn(800, 2.0, 4.0, 1, 0.5, 1.25)
    result["figures"] |= pool_figures(
        {pools.OURS: [turn] * 2, pools.UNILAB: [replace(turn, samples=640)] * 2}, 1e-12
    )
    page = peers.rendered(result)
    assert "| UniLab's pool | 320 (320-320) | 6250.0 (6250.0-6250.0) |" in page
    assert "| Batch relative to the pool | 1.25 (1.25-1.25) | 1.25 (1.25-1.25) |" in page


def test_the_page_is_that_of_the_committed_measurement() -> None:
    """Its figures are those of its turns: none is written by hand."""
    committed = json.loads(peers.FILE.read_text())
    taken = {name: [Turn(**t) for t in some] for name, some in committed["turns"].items()}
    stepped = {name: taken.pop(name) for name in (pools.OURS, pools.UNILAB) if name in taken}
    difference = committed["figures"].get("pool_state_difference", 0.0)
    over_ray = {
        name: taken.pop(name)
        for name in list(taken)
        if name.startswith((f"{OURS_FLEET}_", f"{FLEETS}_"))
    }
    figures = figures_of(taken) | pool_figures(stepped, difference) | fleet_figures(over_ray)
    assert figures == committed["figures"]
    assert set(committed["peers"]) <= set(NAMES) and committed["peers"]
    assert hook.pages()["results/peers.md"].startswith(peers.rendered(committed))


def test_fleets_have_a_section_where_they_were_measured() -> None:
    result = measured()
    assert "Over Ray" not in peers.rendered(result)
    slow = [Turn(400, 2.0, 5.0, 1, 0.5, 1.25)] * 2
    result["figures"] |= fleet_figures({"inhabit_ray_2": turns(1000, 4.0)[:2], "rllib_2": slow})
    page = peers.rendered(result)
    # 500 and 200 samples/s; 250 and 80 samples per processor second
    wanted = "| 2 | 500 (500-500) | 200 (200-200) | 2.50 (2.50-2.50) | 3.12 (3.12-3.12) |"
    assert "Over Ray" in page and wanted in page
