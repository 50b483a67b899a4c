"""Objects of clips, in the clip's world: seat, bed, box, and the recorded skeleton."""

from dataclasses import dataclass, replace

import numpy as np

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Seat:
    """The seat of a clip, inferred or given."""

    point_m: Point
    """The point on the seat's surface below the pelvis, world."""
    facing_rad: float
    """Facing of the seated character, world."""
    from_frame: int
    to_frame: int
    """Contact lasts from `from_frame` to one before this frame."""

    def mirrored(self) -> "Seat":
        """The seat reflected left to right (y -> −y)."""
        return replace(self, point_m=_reflected(self.point_m), facing_rad=-self.facing_rad)

    def raised(self, by_m: float) -> "Seat":
        """The seat `by_m` higher."""
        return replace(self, point_m=_raised(self.point_m, by_m))


@dataclass(frozen=True)
class Bed:
    """The bed of a clip, inferred or given."""

    hip_m: Point
    """The point on the surface below the pelvis, world."""
    head_m: Point
    """The point on the surface below the head, world; as high as the hip's."""
    facing_rad: float
    """Yaw of the access side, square to the line from hip to head, world."""
    from_frame: int
    to_frame: int
    """Contact lasts from `from_frame` to one before this frame."""

    @property
    def height_m(self) -> float:
        """Height of the surface above the floor."""
        return self.hip_m[2]

    def mirrored(self) -> "Bed":
        """The bed reflected left to right (y -> −y)."""
        return replace(
            self,
            hip_m=_reflected(self.hip_m),
            head_m=_reflected(self.head_m),
            facing_rad=-self.facing_rad,
        )

    def raised(self, by_m: float) -> "Bed":
        """The bed `by_m` higher."""
        return replace(self, hip_m=_raised(self.hip_m, by_m), head_m=_raised(self.head_m, by_m))


@dataclass(frozen=True)
class BoxTrack:
    """The box of a clip, frame by frame."""

    pose: np.ndarray
    """[T, 7] float32: centre (m) and rotation (unit quaternion w, x, y, z), world. The box's axes:
    y between the hands, z up, x away from the character."""
    size_m: Point
    """Edge lengths along the box's axes."""
    held: np.ndarray
    """[T] bool: the box is in the hands."""

    def mirrored(self) -> "BoxTrack":
        """The box reflected left to right (y -> −y); its shape is its own mirror image."""
        signs = np.array([1, -1, 1, 1, -1, 1, -1], np.float32)
        return replace(self, pose=self.pose * signs)

    def part(self, start: int, stop: int) -> "BoxTrack":
        """The frames from `start` to one before `stop`."""
        return replace(self, pose=self.pose[start:stop], held=self.held[start:stop])


@dataclass(frozen=True)
class Skeleton:
    """The recorded skeleton of a retargeted clip, which the player shows beside the character."""

    names: tuple[str, ...]
    """Names of the J joints."""
    parents: tuple[int, ...]
    """Each joint's parent, −1 for a root."""
    position_m: np.ndarray
    """[T, J, 3] float32: the joints in the clip's world, scaled as the clip, at their recorded
    height."""

    def mirrored(self) -> "Skeleton":
        """The skeleton reflected left to right (y -> −y)."""
        return replace(self, position_m=self.position_m * np.array([1, -1, 1], np.float32))

    def part(self, start: int, stop: int) -> "Skeleton":
        """The frames from `start` to one before `stop`."""
        return replace(self, position_m=self.position_m[start:stop])


def _reflected(point: Point) -> Point:
    x, y, z = point
    return x, -y, z


def _raised(point: Point, by_m: float) -> Point:
    x, y, z = point
    return x, y, z + by_m
