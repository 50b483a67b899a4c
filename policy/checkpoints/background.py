"""Blocking work on daemon threads, such as reads from a network disk, for an event loop."""

import asyncio
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Result = TypeVar("Result")


async def run_in_background(work: Callable[..., Result], *arguments: Any) -> Result:
    """Result of `work(*arguments)`, run on a daemon thread.

    The process does not wait for that thread at exit. It would wait for a thread pool, and a read
    that hangs would then keep it from ending.
    """
    loop = asyncio.get_running_loop()
    found: asyncio.Future[Result] = loop.create_future()

    def end(value: Any, error: BaseException | None) -> None:
        if found.done():
            return
        if error is None:
            found.set_result(value)
        else:
            found.set_exception(error)

    def run() -> None:
        value, failed = None, None
        try:
            value = work(*arguments)
        except BaseException as error:
            failed = error
        try:
            loop.call_soon_threadsafe(end, value, failed)
        except RuntimeError:
            return  # the loop is closed

    threading.Thread(target=run, name="background", daemon=True).start()
    return await found
