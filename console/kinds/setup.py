"""What a scene of the player is made of: policy, piece and size, start and goal."""

import math
from dataclasses import dataclass

from world.affordances import Affordance
from world.errors import ConfigError
from world.furniture.piece import Piece

#: Scales that the player offers; those of training are 0.8 to 1.2, of boxes 0.5 to 1.5.
SCALES = (0.5, 1.5)
#: Nothing is put farther from the origin than this, m.
FAR_M = 20.0


@dataclass(frozen=True)
class Pose:
    """A place on the floor, world frame: x, y (m) and a heading (rad, about +z from +x)."""

    x: float
    y: float
    yaw: float = 0.0

    def stepped(self, wanted: "Pose", far_m: float, turn_rad: float) -> "Pose":
        """Towards `wanted`, by no more than `far_m` and `turn_rad`."""
        x, y = wanted.x - self.x, wanted.y - self.y
        distance = math.hypot(x, y)
        share = min(1.0, far_m / distance) if distance else 1.0
        turn = math.remainder(wanted.yaw - self.yaw, 2 * math.pi)
        turn = max(-turn_rad, min(turn_rad, turn))
        return Pose(self.x + share * x, self.y + share * y, self.yaw + turn)


@dataclass(frozen=True)
class Setup:
    """How a scene begins."""

    policy: str
    """Name of the policy."""
    piece: str
    """Name of the piece of furniture; of carry, the box."""
    scale: float = 1.0
    side: int = 0
    """Which of the piece's places of use: of a bed, the side that it is got onto by."""
    start: Pose = Pose(0.0, 0.0)
    """Where the character stands, and its heading."""
    goal: Pose = Pose(2.5, 0.0, math.pi)
    """The place of use and the heading of who uses it; of carry, where the box is to go."""
    box: Pose = Pose(1.2, 0.0, math.pi)
    """Of carry: where the box stands at first."""
    seed: int = 0
    """Of the balls."""


def check(setup: Setup, piece: Piece, affordance: Affordance) -> Setup:
    """The setup itself; ConfigError where its numbers make no scene."""
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
