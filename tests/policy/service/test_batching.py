"""Batches: what is waited for, learned from those that came before."""

import asyncio

import numpy as np
from prometheus_client import CollectorRegistry

from policy.checkpoints.served import Served
from policy.config import BatchConfig
from policy.service.batching import Answer, Batcher, BatchMetrics
from tests.support.policy_cases import make


def batcher(wait_s: float, passes: list[int] | None = None) -> Batcher:
    """`passes`: gets an entry for every forward pass."""
    served, counted = make(), [] if passes is None else passes
    registry = CollectorRegistry()

    def asked() -> Served:
        counted.append(len(counted))
        return served

    return Batcher(asked, BatchConfig(max_wait_s=wait_s), BatchMetrics(registry))


def test_calls_that_come_apart_share_batches() -> None:
    """One after the other, closer than the wait: soon they are answered together."""
    served = make()
    row = np.zeros(served.width, "<f4").tobytes()

    async def main() -> list[int]:
        passes: list[int] = []
        queue, loop = batcher(0.02, passes), asyncio.get_running_loop()
        done: list[int] = []

        async def call() -> Answer:
            queue.calls += 1
            try:
                answer = await queue.submit(row, 1, False, None)
            finally:
                queue.calls -= 1
            done.append(len(passes))
            return answer

        calls = []
        for _ in range(600):
            calls.append(loop.create_task(call()))
            await asyncio.sleep(0.0005)
        await asyncio.gather(*calls)
        return done

    done = asyncio.run(main())
    assert len(done) == 600
    # answers of one batch come with the same pass
    early, late = np.diff(done[:200]), np.diff(done[-200:])
    assert (early == 0).mean() < 0.3 and (late == 0).mean() > 0.6


def test_streams_are_counted_and_not_guessed() -> None:
    """With two streams open, an answer comes when both have asked: the wait would never end."""
    row = np.zeros(make().width, "<f4").tobytes()

    async def main() -> bool:
        queue = batcher(wait_s=600.0)
        queue.streams = 2
        first = queue.submit(row, 1, False, None)
        await asyncio.sleep(0.05)
        alone = first.done()
        both = asyncio.gather(first, queue.submit(row, 1, False, None))
        await asyncio.wait_for(both, 60)
        return alone

    assert not asyncio.run(main())
