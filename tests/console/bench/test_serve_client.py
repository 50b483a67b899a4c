"""The bench's client: figures by hand, and calls that all get answers."""

import asyncio
from types import SimpleNamespace

import pytest

from console.bench.serve_client import Client, _figures


def test_figures_leave_the_first_tenth_out() -> None:
    spent = [9.0] * 10 + [0.001] * 89 + [0.101]
    found = _figures(spent, wall=2.0)
    assert found["p50_ms"] == pytest.approx(1.0) and found["per_s"] == 50.0
    assert 1.0 < found["p99_ms"] < 101.0


def test_every_caller_asks_with_one_row() -> None:
    asked = []

    async def act(request: object, metadata: object) -> None:
        asked.append(request)
        await asyncio.sleep(0.001)

    client = Client(SimpleNamespace(Act=act), seconds=0.02)
    found = asyncio.run(client.act(3))
    assert found["per_s"] > 0.0 and len(asked) >= 3
    assert {(len(r.state), len(r.goal), r.task) for r in asked} == {(4 * 114, 4 * 29, "sit")}
