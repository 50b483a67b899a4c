"""Setup of a scene of the player: policy, piece and size, initial pose and target."""

import math
from dataclasses import dataclass

from world.affordances import Affordance
from world.errors import ConfigError
from world.furniture.piece import Piece

#: Scales in the player; those of training are 0.8 to 1.2, of boxes 0.5 to 1.5.
SCALES = (0.5, 1.5)
#: Largest coordinate of an object, m.
FAR_M = 20.0


@dataclass(frozen=True)
class Pose:
    """A pose on the floor, world frame: x, y (m) and a heading (rad, about +z from +x)."""

    x: float
    y: float
    yaw: float = 0.0

    def stepped(self, wanted: "Pose", far_m: float, turn_rad: float) -> "Pose":
        """Return the pose moved towards `wanted`, by at most `far_m` and `turn_rad`."""
        x, y = wanted.x - self.x, wanted.y - self.y
        distance = math.hypot(x, y)
        fraction = min(1.0, far_m / distance) if distance else 1.0
        turn = math.remainder(wanted.yaw - self.yaw, 2 * math.pi)
        turn = max(-turn_rad, min(turn_rad, turn))
        return Pose(self.x + fraction * x, self.y + fraction * y, self.yaw + turn)


@dataclass(frozen=True)
class Setup:
    """The initial state of a scene."""

    policy: str
    """Name of the policy."""
    piece: str
    """Name of the piece of furniture; for carry, of the box."""
    scale: float = 1.0
    """Scale of the piece."""
    side: int = 0
    """Index of the use point of the piece, such as the sides of a bed."""
    start: Pose = Pose(0.0, 0.0)
    """Initial stand pose of the character."""
    goal: Pose = Pose(2.5, 0.0, math.pi)
    """Target: the use point with its facing; for carry, the target of the box."""
    box: Pose = Pose(1.2, 0.0, math.pi)
    """Initial pose of the box; carry only."""
    seed: int = 0
    """Seed of the balls."""


def check(setup: Setup, piece: Piece, affordance: Affordance) -> Setup:
    """Return the setup; ConfigError for invalid numbers."""
    low, high = SCALES
    if not low <= setup.scale <= high:
        raise ConfigError(f"scale {setup.scale:g}: choose {low:g} to {high:g}")
    for name in ("start", "goal", "box"):
        pose: Pose = getattr(setup, name)
        if not all(math.isfinite(v) for v in (pose.x, pose.y, pose.yaw)):
            raise ConfigError(f"{name}: must be finite numbers")
        if max(abs(pose.x), abs(pose.y)) > FAR_M:
            raise ConfigError(f"{name}: choose x and y within {FAR_M:g} m of the origin")
    sides = affordance.use_point_count(piece)
    if not 0 <= setup.side < sides:
        raise ConfigError(f"side {setup.side}: {piece.name} has sides 0 to {sides - 1}")
    return setup
