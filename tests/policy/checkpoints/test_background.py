"""Work on daemon threads: its result, its error, and no waiting for work that hangs."""

import asyncio
import threading

import pytest

from policy.checkpoints.background import run_in_background


def test_results_and_errors_come_back() -> None:
    async def both() -> int:
        with pytest.raises(ZeroDivisionError):
            await run_in_background(lambda: 1 // 0)
        return await run_in_background(lambda a, b: a + b, 2, 3)

    assert asyncio.run(both()) == 5


def test_the_loop_goes_on_and_ends_while_work_hangs() -> None:
    release = threading.Event()

    async def passes() -> bool:
        hanging = asyncio.ensure_future(run_in_background(release.wait, 60.0))
        await asyncio.sleep(0)
        other = await run_in_background(threading.current_thread)
        assert other.daemon and not hanging.done()
        hanging.cancel()
        return release.is_set()

    assert asyncio.run(passes()) is False
    release.set()
