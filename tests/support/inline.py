"""An executor that does at once, in the calling thread, what it is given."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from typing import Any


class Inline:
    """Like a ThreadPoolExecutor, without threads."""

    def submit(self, call: Callable[..., Any], *args: Any) -> Future:
        found: Future = Future()
        found.set_result(call(*args))
        return found

    def map(self, call: Callable[..., Any], *args: Iterable[Any]) -> Iterator[Any]:
        return map(call, *args)

    def shutdown(self) -> None:
        """Nothing to end."""
