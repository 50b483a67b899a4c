"""Settings of the GPU simulator."""

from dataclasses import dataclass


@dataclass(frozen=True)
class WarpConfig:
    """Room for contacts in mujoco-warp, which is set aside at the start of a run.

    Too little of it stops the run with a line that names the one to raise; nothing is dropped
    silently.
    """

    nconmax: int = 48
    """Contacts a scene, on average over all scenes: they share one pool."""
    njmax: int = 192
    """Rows of constraints a scene, at most in any one of them."""


#: Enough for a character on any furniture, with a box in hand.
DEFAULT = WarpConfig()
