"""How many calls are worth waiting for: learned from how many came when they were waited for."""

from collections import deque

_REMEMBERED = 8
#: One batch in so many waits to its end, to see whether others call as well; a lone caller pays for
#: it with that share of its calls.
_EXPLORED = 256


class BatchSizePredictor:
    """What the last batches tell about the next one.

    Calls arrive one by one, and one that is answered at once has ended before the next is seen, so
    that those in progress say nothing about how many are on their way.
    """

    def __init__(self) -> None:
        self._sizes = deque([1], maxlen=_REMEMBERED)
        self._until_explored = _EXPLORED
        self._wanted = 1

    def expects_more_than(self, calls: int) -> bool:
        """Whether others than these are likely to join them."""
        return calls < self._wanted or self._until_explored == 0

    def observe(self, calls: int) -> None:
        """A batch was made of so many calls."""
        self._sizes.append(calls)
        self._wanted = max(self._sizes)
        self._until_explored = self._until_explored - 1 if self._until_explored else _EXPLORED
