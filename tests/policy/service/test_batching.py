"""Batches: what is waited for, learned from those that came before."""

import asyncio
import time

import numpy as np
from prometheus_client import CollectorRegistry

from policy.config import BatchConfig
from policy.service.batching import Answer, Batcher, BatchMetrics
from tests.support.policy_cases import make


def batcher(wait_s: float) -> Batcher:
    served = make()
    registry = CollectorRegistry()
    return Batcher(lambda: served, BatchConfig(max_wait_s=wait_s), BatchMetrics(registry))


def test_calls_that_come_apart_share_batches() -> None:
    """One after the other, closer than the wait: soon they are answered together."""
    served = make()
    row = np.zeros(served.width, "<f4").tobytes()

    async def main() -> list[float]:
        queue, loop = batcher(wait_s=0.02), asyncio.get_running_loop()
        done: list[float] = []

        async def call() -> Answer:
            queue.calls += 1
            try:
                answer = await queue.submit(row, 1, False, None)
            finally:
                queue.calls -= 1
            done.append(loop.time())
            return answer

        calls = []
        for _ in range(600):
            calls.append(loop.create_task(call()))
            await asyncio.sleep(0.0005)
        await asyncio.gather(*calls)
        return done

    done = asyncio.run(main())
    assert len(done) == 600
    # answers of one batch come at once
    early, late = np.diff(done[:200]), np.diff(done[-200:])
    assert (early < 2e-4).mean() < 0.3 and (late < 2e-4).mean() > 0.6


def test_streams_are_counted_and_not_guessed() -> None:
    """With two streams open, an answer comes when both have asked, long before the wait ends."""
    row = np.zeros(make().width, "<f4").tobytes()

    async def main() -> tuple[float, bool]:
        queue = batcher(wait_s=5.0)
        queue.streams = 2
        began = time.monotonic()
        first = queue.submit(row, 1, False, None)
        await asyncio.sleep(0.05)
        alone = first.done()
        await asyncio.gather(first, queue.submit(row, 1, False, None))
        return time.monotonic() - began, alone

    spent, alone = asyncio.run(main())
    assert not alone and spent < 2.0
