"""The support of a clip: a seat or a bed that fits it, so that no body part penetrates it.

The clips' own furniture was not recorded. A seat is a plate at the height of the resting pelvis,
with a back where the trunk leans; a bed is a block. Their edges are moved inwards until the legs
are clear.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from world.character.model import BODIES
from world.furniture.piece import Box, Piece
from world.motions.clip import Clip
from world.objects import clearance
from world.scene.box import STAND

Point = tuple[float, float, float]

#: Position of unused objects, m.
AWAY_M: Point = (-50.0, 0.0, 0.2)
#: Tolerated penetration of a limb into the side of a support, m; depth of its top below the body,
#: m.
_TOLERATED_M, _SUNK_M = 0.015, 0.01
#: Half width, and extent ahead of and behind the use point, of the largest and the smallest seat,
#: m; step by which edges move inwards, m.
_SEAT_M, _LEAST_M, _STEP_M = (0.28, 0.24, 0.26), (0.12, 0.02, 0.08), 0.02
_SEAT_THICK_M = 0.06
#: Height and thickness of a back, m, and the least lean of the trunk for which a seat has one, rad.
_BACK_M, _BACK_THICK_M, _LEANS_RAD = 0.55, 0.05, 0.12
#: Extent of the largest and the smallest bed beyond the head, beyond the hip and to each side, m.
_BED_M, _LEAST_BED_M = (0.45, 1.15, 0.55), (0.20, 0.30, 0.20)
#: A limb whose centre is at most this far below the top lies on it, m.
_LIES_M, _FAR_M = 0.05, 1e3
#: Stride of the frames that are checked.
_EVERY = 3
#: Beds lower than this are the floor, m.
_FLOOR_M = 0.05


@dataclass(frozen=True)
class Support:
    """A piece and its pose in the clip's world."""

    piece: Piece
    origin_m: Point
    yaw_rad: float
    point_m: Point
    """Use point, on the surface."""
    head_m: Point
    """Point of a bed below the head; of a seat the use point."""

    def mirrored(self) -> "Support":
        """Return the mirror image (y -> −y); its boxes are symmetric."""

        def reflected(point: Point) -> Point:
            return point[0], -point[1], point[2]

        return Support(
            self.piece,
            reflected(self.origin_m),
            -self.yaw_rad,
            reflected(self.point_m),
            reflected(self.head_m),
        )


def support(clip: Clip) -> Support:
    """Return the support of a clip; an unused stand, out of reach, for a clip without one or with a
    box, which has stands of its own."""
    if clip.box is None and clip.seat is not None:
        return _seat(clip)
    if clip.box is None and clip.bed is not None and clip.bed.height_m > _FLOOR_M:
        return _bed(clip)
    return Support(STAND, AWAY_M, 0.0, AWAY_M, AWAY_M)


def supports(clips: Sequence[Clip]) -> list[Support]:
    """Return the supports of `clips`; a mirror image after its clip gets the mirrored support."""
    found: list[Support] = []
    for number, clip in enumerate(clips):
        image = number > 0 and clip.name == f"{clips[number - 1].name}~mirrored"
        found.append(found[-1].mirrored() if image else support(clip))
    return found


def sunk_m(clip: Clip, found: Support) -> NDArray[np.float64]:
    """Return the penetration of the body into its support in each frame [T], m; 0: clear."""
    spheres = _spheres(clip, found.origin_m, found.yaw_rad)
    depth = np.max([_depth(spheres, box).max(axis=1) for box in found.piece.boxes], axis=0)
    return np.maximum(depth, 0.0)


def _seat(clip: Clip) -> Support:
    seat = clip.seat
    assert seat is not None
    x, y, z = seat.point_m
    origin, top = (x, y, 0.0), z - _SUNK_M
    spheres = _spheres(clip, origin, seat.facing_rad)

    def plate(edges: tuple[float, ...]) -> Box:
        side, ahead, behind = edges
        return Box(
            (0.5 * (ahead - behind), 0.0, top - 0.5 * _SEAT_THICK_M),
            (0.5 * (ahead + behind), side, 0.5 * _SEAT_THICK_M),
        )

    fitted = _drawn_in(_SEAT_M, _LEAST_M, plate, spheres, top)
    boxes = [plate(fitted)]
    back = _back(clip, spheres, slice(seat.from_frame, seat.to_frame), top, fitted[0])
    if back is not None:
        boxes.append(back)
    return Support(
        Piece("seat", "support", tuple(boxes), (), 1.0),
        origin,
        seat.facing_rad,
        seat.point_m,
        seat.point_m,
    )


def _back(
    clip: Clip, spheres: NDArray[np.float64], seated: slice, top: float, side: float
) -> Box | None:
    """Return a back behind a leaning trunk; None if another body part is in its place."""
    trunk = _trunk()
    hip, chest = spheres[seated, trunk[0], :3], spheres[seated, trunk[-1], :3]
    lean = np.arctan2(hip[:, 0] - chest[:, 0], chest[:, 2] - hip[:, 2])
    if float(np.percentile(lean, 80)) < _LEANS_RAD:
        return None
    behind = (spheres[seated][:, trunk, 0] - spheres[seated][:, trunk, 3]).min(axis=1)
    face = float(np.percentile(behind, 10))
    box = Box(
        (face - 0.5 * _BACK_THICK_M, 0.0, top + 0.5 * _BACK_M),
        (0.5 * _BACK_THICK_M, side, 0.5 * _BACK_M),
    )
    others = np.delete(spheres, trunk, axis=1)
    return box if _depth(others, box).max() <= 3 * _TOLERATED_M else None


def _bed(clip: Clip) -> Support:
    bed = clip.bed
    assert bed is not None
    hip, head = np.array(bed.hip_m), np.array(bed.head_m)
    top = float(hip[2]) - _SUNK_M
    along = (head - hip)[:2]
    yaw = float(np.arctan2(along[1], along[0]))
    origin = (float(hip[0]), float(hip[1]), 0.0)
    length = float(np.linalg.norm(along))
    spheres = _spheres(clip, origin, yaw)

    def block(edges: tuple[float, ...]) -> Box:
        beyond, feet, side = edges
        low, high = -feet, length + beyond
        return Box((0.5 * (low + high), 0.0, 0.5 * top), (0.5 * (high - low), side, 0.5 * top))

    fitted = _drawn_in(_BED_M, _LEAST_BED_M, block, spheres, top)
    piece = Piece("bed", "support", (block(fitted),), (), 1.0)
    return Support(piece, origin, yaw, bed.hip_m, bed.head_m)


def _drawn_in(
    largest: tuple[float, ...],
    least: tuple[float, ...],
    made: Callable[[tuple[float, ...]], Box],
    spheres: NDArray[np.float64],
    top: float,
) -> tuple[float, ...]:
    """Return edges between `largest` and `least` at which no limb penetrates the box's side;
    greedy: the edge with the largest gain moves first."""
    edges = list(largest)
    beside = spheres[::_EVERY].copy()
    beside[beside[..., 2] > top - _LIES_M, :3] = _FAR_M

    def clash(of: list[float]) -> float:
        return float(np.maximum(_depth(beside, made(tuple(of))) - _TOLERATED_M, 0.0).sum())

    now = clash(edges)
    while now > 0.0:
        tried = list(_tighter(edges, least))
        if not tried:
            break
        gained = [clash(one) for one in tried]
        edges, now = tried[int(np.argmin(gained))], min(gained)
    return tuple(edges)


def _tighter(edges: list[float], least: tuple[float, ...]) -> Iterator[list[float]]:
    for k, (edge, smallest) in enumerate(zip(edges, least, strict=True)):
        if edge - _STEP_M >= smallest:
            yield [*edges[:k], edge - _STEP_M, *edges[k + 1 :]]


def _spheres(clip: Clip, origin: Point, yaw: float) -> NDArray[np.float64]:
    """[T, P, 4]: the character's spheres in a frame on the floor: centres and radius, m."""
    centres = clearance.points(torch.from_numpy(clip.qpos())).double().numpy() - np.array(origin)
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, z = np.moveaxis(centres, -1, 0)
    radius = np.broadcast_to(clearance.RADII.numpy(), x.shape)
    return np.stack((cos * x + sin * y, cos * y - sin * x, z, radius), axis=-1)


def _trunk() -> list[int]:
    """Indices of the spheres of pelvis and torso, lowest first."""
    wanted = (BODIES.index("pelvis"), BODIES.index("torso"))
    return [i for i, body in enumerate(clearance.BODIES.tolist()) if body in wanted]


def _depth(spheres: NDArray[np.float64], box: Box) -> NDArray[np.float64]:
    """Return the penetration [..] of spheres [.., 4] into an axis-aligned box, m; negative:
    clear."""
    beyond = np.abs(spheres[..., :3] - np.array(box.centre_m)) - np.array(box.half_m)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=-1)
    return spheres[..., 3] - outside - np.minimum(beyond.max(axis=-1), 0.0)
