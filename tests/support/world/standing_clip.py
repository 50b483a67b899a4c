"""A clip of someone who stands before a box and picks it up."""

import numpy as np

from world.motions.clip import Clip
from world.motions.synthetic.carries import carrying


def standing_clip() -> Clip:
    """Someone stands before a box, takes it, walks, puts it down and stands."""
    whole = carrying(np.random.default_rng(3), (0.25, 0.36, 0.22), (0.25, 0.25), 1.5, 0.6)
    assert whole.box is not None
    held = np.flatnonzero(whole.box.held)
    slow = np.linalg.norm(whole.qvel()[:, :2], axis=1) < 0.1
    first = next(t for t in range(held[0] - 90, held[0]) if slow[t : held[0] - 45].all())
    return whole.part(int(first), whole.frames)
