"""Work beside an event loop that may never end, as a read from a network disk: nobody waits for it
at the end of the process."""

import asyncio
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Result = TypeVar("Result")


async def run_in_background(work: Callable[..., Result], *arguments: Any) -> Result:
    """What `work(*arguments)` gives, on a thread of its own that the process does not wait for.

    A pool of threads is joined at exit: one read that hangs would keep the process for ever.
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
            return  # the loop is gone

    threading.Thread(target=run, name="background", daemon=True).start()
    return await found
