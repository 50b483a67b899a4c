"""The player without a browser: policies, live scenes, and what moves in them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from console.kinds.setup import Setup
from console.play.live import Live
from console.play.stock import Stock
from tests.support import policy_cases

POLICIES = {task: policy_cases.make(1, task, task) for task in ("sit", "lie", "carry")}
#: Does nothing: what moves it is something else.
LIMP = replace(
    POLICIES["sit"], weights={k: 0 * v if "actor" in k else v for k, v in
                              POLICIES["sit"].weights.items()}
)  # fmt: skip


def stock(**policies: object) -> Stock:
    return Stock({**POLICIES, **policies})  # pyright: ignore


def live(task: str = "sit", **changes: object) -> Live:
    found = stock(limp=LIMP)
    piece = next(iter(found.pieces(task)))
    return found.begin(replace(Setup(task, piece), **changes))  # pyright: ignore


def qpos(source: Live, frame: int) -> NDArray[np.float64]:
    return source.moments[frame].physics["qpos"][0].numpy()
