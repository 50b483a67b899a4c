"""Stand-ins for rollout actors, which sleep as long as real ones compute; they need no torch."""

import threading
import time
from collections import defaultdict
from typing import Any

import numpy as np


class Sleepers:
    """Any number of actors in one process, a thread a call: light enough for hundreds of them.

    What they send is as large as a real rollout, and a fresh object every time. An actor does one
    thing after the other: what it is asked for meanwhile waits, as in the queue of a real one.
    """

    def __init__(self, packed: dict[str, Any]) -> None:
        self._packed = packed
        self._acting: dict[int, threading.Lock] = defaultdict(threading.Lock)

    def rollout(
        self, weights: dict[str, np.ndarray], version: int, actor: int, scene: int, seconds: float
    ) -> dict[str, Any]:
        """Sleep so long, and give the rollout of the scenes from `scene` on."""
        del weights  # that they are here is all
        with self._acting[actor]:
            time.sleep(seconds)
        slept = {"world": seconds, "policy": 0.0}
        return self._packed | {"version": version, "first_scene": scene, "seconds": slept}
