"""Stand-ins for rollout actors, which sleep instead of computing; without torch."""

import threading
import time
from collections import defaultdict
from typing import Any

import numpy as np


class Sleepers:
    """Stand-ins for any number of actors in one process, with one thread per call.

    A rollout has its real size and is a new object each time. An actor handles requests one after
    the other, as the queue of a real actor does.
    """

    def __init__(self, packed: dict[str, Any]) -> None:
        self._packed = packed
        self._acting: dict[int, threading.Lock] = defaultdict(threading.Lock)

    def rollout(
        self, weights: dict[str, np.ndarray], version: int, actor: int, scene: int, seconds: float
    ) -> dict[str, Any]:
        """Sleep for `seconds`; return the rollout of the scenes from `scene` on."""
        del weights  # only their transfer matters
        with self._acting[actor]:
            time.sleep(seconds)
        slept = {"world": seconds, "policy": 0.0}
        return self._packed | {"version": version, "first_scene": scene, "seconds": slept}
