"""Prediction of the number of calls in the next batch, from the last batches."""

from collections import deque

_REMEMBERED = 8
#: One batch in so many waits its full time, to measure whether there are other callers. A lone
#: caller pays for it with that fraction of its calls.
_EXPLORED = 256


class BatchSizePredictor:
    """Predictor of the number of calls of a batch: the largest of the last batches.

    Calls arrive one by one, and a call that is answered at once ends before the next one arrives.
    The number of calls in progress is therefore no measure of the number of callers.
    """

    def __init__(self) -> None:
        self._sizes = deque([1], maxlen=_REMEMBERED)
        self._until_explored = _EXPLORED
        self._wanted = 1

    def expects_more_than(self, calls: int) -> bool:
        """Whether more than this number of calls is expected."""
        return calls < self._wanted or self._until_explored == 0

    def observe(self, calls: int) -> None:
        """Record the number of calls of a batch."""
        self._sizes.append(calls)
        self._wanted = max(self._sizes)
        self._until_explored = self._until_explored - 1 if self._until_explored else _EXPLORED
