"""Builds a piece from a mesh: upright, decomposed into hulls, with the targets found on it."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.furniture import affordance
from world.furniture.affordance import lying, seats
from world.furniture.affordance.relief import Relief, relief, sheltered
from world.furniture.affordance.seats import Zone, zone_heights
from world.furniture.piece import Hull, Lying, Piece, SeatTarget
from world.meshes import axes, decompose, hints, resting
from world.meshes.classes import CLASSES, DENSITY_KG_M3, LEAST_KG, category_of, shape_of
from world.meshes.frame import Frame
from world.meshes.source import Source
from world.meshes.upright import placed
from world.objects.drop_test import slips_at

MOST_OFF_M = 0.05
"""Greatest distance of the hulls from the mesh at which a target's height follows the hulls."""

COARSE_M = 0.02
"""Error of a seat's height beyond which the mesh is decomposed again with more voxels."""
FINER = 4
"""Factor of the number of voxels for that."""
BULGE_M = 0.07
"""Hulls up to this height above a seat belong to it and are cut level with it."""

SHIFTED_M = 0.14
"""Greatest shift of a target along its facing to where the hulls leave room and carry."""
ROOM, CARRYING = Zone((-0.14, 0.10), (-0.12, 0.12)), Zone((0.04, 0.20), (-0.12, 0.12))
"""Zones where no hull may be above the seat, and where hulls must carry the thighs."""
STEP_M, RISEN_M, UNEVEN_M = 0.02, 0.045, 0.025
"""Step of such a shift; height above the seat that blocks; tolerance of a carrying surface."""

_NEEDS_SEAT = ("chair", "armchair", "low-stool", "high-stool", "sofa", "bed")
_LAIN_ON = ("sofa", "bed", "table")
LONG_M, DEEP_M = 1.50, 0.60
"""Least size of a table that one lies on: its top carries head, trunk and most of the legs."""


@dataclass(frozen=True)
class ImportOptions:
    """Options of the import of a mesh."""

    frame: Frame = field(default_factory=Frame)
    """Axes and size."""
    category: str | None = None
    """A class, whatever the shape; None: by the piece's shape and name."""
    named: str | None = None
    """A class that the name states, or `stool`; None without one."""
    licence: str = "unknown"
    credit: str = ""
    sit: tuple[float, float, float, float] | None = None
    """x, y, z (m) and yaw (degrees) of the seat target; None: found from the geometry."""
    force: bool = False
    """Whether a piece off which its own drop test throws the ragdoll is imported."""


@dataclass(frozen=True)
class Built:
    """A piece with measures of its build."""

    piece: Piece
    centre_of_mass_m: NDArray[np.float64]
    """[3], piece frame."""
    inertia_kg_m2: NDArray[np.float64]
    """[3, 3], about the centre of mass."""
    seat_error_m: float | None
    """Height of the hulls above the mesh at the first seat target; None without one."""
    notes: tuple[str, ...] = ()
    """Remarks for the user: what was left out, or decided against the name."""


@dataclass(frozen=True)
class Places:
    """The class of a mesh and the targets found on it."""

    category: str
    sit: tuple[SeatTarget, ...]
    lie: Lying | None
    roofed: bool
    """Whether the targets are below a roof."""
    notes: tuple[str, ...] = ()


def build(source: Source, options: ImportOptions) -> Built:
    """The piece of a mesh. Raises PieceError where it is no furniture or has no target."""
    named = options.category or options.named
    stated_up = options.frame.up is not None
    frame, turned = axes.resolved(source, options.frame, options.force)
    options = replace(options, frame=frame)
    triangles, notes = placed(source, frame, named)
    try:
        found = places(source.name, triangles, options)
    except PieceError as error:
        flags = hints.flags(source, options.frame, named, hints.ORDINARY)
        if not flags:
            raise
        raise PieceError(f"{error}; with {flags} it is ordinary furniture") from error
    if not options.force and options.sit is None:
        hints.require_ordinary(source, options.frame, triangles, named, stated_up)
    piece, error = _cut(source.name, triangles, options, found, decompose.VOXELS)
    if _faults(piece, error):
        # a hull bulges over the seat, or a ragdoll slides off: more voxels often help
        fine = _cut(source.name, triangles, options, found, FINER * decompose.VOXELS)
        cuts = [(piece, error), fine]
        piece, error = min(cuts, key=lambda cut: (_faults(*cut), abs(cut[1] or 0.0)))
    if not options.force:
        piece = resting.required(piece)
    density, least_kg = DENSITY_KG_M3[piece.category], LEAST_KG[piece.category]
    mass, centre, inertia = decompose.mass_properties(piece.hulls, density, least_kg)
    said = [*turned, *notes, *found.notes]
    if error is not None and abs(error) > COARSE_M:
        where = "above" if error > 0.0 else "below"
        said.append(f"its hulls are {100 * abs(error):.0f} cm {where} the mesh at the seat")
    return Built(replace(piece, mass_kg=mass), centre, inertia, error, tuple(said))


def _cut(
    name: str,
    triangles_m: NDArray[np.float64],
    options: ImportOptions,
    found: Places,
    voxels: int,
) -> tuple[Piece, float | None]:
    """The piece decomposed with so many voxels and drop-tested, and the upward shift of its first
    seat by the decomposition, m."""
    parts = decompose.hulls(triangles_m, name, voxels)
    piece, error = located(name, parts, options, found)
    if options.sit is not None:
        return resting.tested(piece), error
    return resting.confirmed(piece, _solid(piece.hulls, found.roofed)), error


def _faults(piece: Piece, error: float | None) -> int:
    """Number of scales at which the ragdoll does not rest on the first seat, plus 1 where the error
    of its height is above COARSE_M."""
    missed = sum(len(slips_at(target)) for target in piece.sit[:1])
    return missed + int(error is not None and abs(error) > COARSE_M)


def places(name: str, triangles_m: NDArray[np.float64], options: ImportOptions) -> Places:
    """The class and the targets of triangles [m, 3, 3] m: under open space, else below a roof.

    Raises PieceError for what is no furniture of the class.
    """
    surface, roofed = relief(triangles_m), False
    sit, lie = seats.find(surface), lying.find(surface)
    if not sit and lie is None:
        surface, roofed = sheltered(triangles_m), True
        sit, lie = seats.find(surface), lying.find(surface)
    low, high = triangles_m.min(axis=(0, 1)), triangles_m.max(axis=(0, 1))
    size = decompose.vector(high - low)
    category, remark = options.category, ""
    if category is None:
        category, remark = category_of(options.named, shape_of(size, surface, sit, lie))
    shown = f"({' x '.join(f'{x:.2f}' for x in size)} m)"
    if category is None:
        if options.sit is None:
            raise PieceError(
                f"{name}: no place to sit or lie and no table's top in it {shown}; check --up, "
                "--unit, or give --category and --sit"
            )
        category = options.named if options.named in CLASSES else "chair"
    if category not in DENSITY_KG_M3:
        raise PieceError(f"{name}: unknown class '{category}'; choose {', '.join(DENSITY_KG_M3)}")
    small = category == "table" and (max(size[:2]) < LONG_M or min(size[:2]) < DEEP_M)
    lie = lie if category in _LAIN_ON and not small else None
    if lie is not None and category != "sofa":
        sit = lying.edges(surface, lie) or sit
    if options.sit is not None:
        x, y, z, yaw = options.sit
        sit = (SeatTarget((x, y, z), math.radians(yaw)),)
    elif not sit and category in _NEEDS_SEAT:
        raise PieceError(
            f"{name}: no place to sit on this {category} {shown}; check --up, --unit, or give --sit"
        )
    return Places(category, sit, lie, roofed, (remark,) if remark else ())


def located(
    name: str, parts: tuple[Hull, ...], options: ImportOptions, found: Places
) -> tuple[Piece, float | None]:
    """The piece of these hulls with the targets of its mesh moved onto the surface of the hulls,
    and the upward shift of the first seat by that, m."""
    sit, lie = found.sit, found.lie
    if options.sit is None:
        parts = _levelled(parts, sit)
    solid = _solid(parts, found.roofed)
    levelled_sit = tuple(_onto(solid, target) for target in _fitting(solid, sit))
    error = levelled_sit[0].point_m[2] - sit[0].point_m[2] if sit else None
    piece = Piece(
        name,
        found.category,
        tuple(decompose.around(hull) for hull in parts),
        levelled_sit if options.sit is None else sit,
        1.0,
        licence=options.licence,
        lie=None if lie is None else _lying_onto(solid, lie),
        hulls=parts,
        credit=options.credit,
    )
    return piece, error


def _solid(parts: tuple[Hull, ...], roofed: bool = False) -> Relief:
    """The relief of hulls."""
    corners = np.array([np.array(h.vertices_m)[list(f)] for h in parts for f in h.faces])
    return sheltered(corners) if roofed else relief(corners)


def _levelled(parts: tuple[Hull, ...], sit: tuple[SeatTarget, ...]) -> tuple[Hull, ...]:
    """The hulls, cut off at the height of the seat above them: a hull spans the hollow of a dished
    seat or cushion, and a character would sit above its surface."""
    result = []
    for hull in parts:
        points = np.array(hull.vertices_m)
        low, high = points.min(axis=0), points.max(axis=0)
        under = [
            p.point_m[2]
            for p in sit
            if (np.abs(np.clip(p.point_m[:2], low[:2], high[:2]) - p.point_m[:2]) < 0.10).all()
            and 0.0 < high[2] - p.point_m[2] < BULGE_M
        ]
        result.append(decompose.lowered(hull, min(under)) if under else hull)
    return tuple(hull for hull in result if hull is not None)


def _fitting(solid: Relief, sit: tuple[SeatTarget, ...]) -> tuple[SeatTarget, ...]:
    """The targets that the hulls leave room for, and always the first one."""
    found = [_moved(solid, target) for target in sit]
    return tuple(
        moved or target
        for index, (target, moved) in enumerate(zip(sit, found, strict=True))
        if moved is not None or index == 0
    )


def _moved(solid: Relief, target: SeatTarget) -> SeatTarget | None:
    """The target with the least shift along its facing by which the pelvis is clear of the hulls of
    a back and the thighs are carried; None without one."""
    x, y, z = target.point_m
    cos, sin = math.cos(target.facing_rad), math.sin(target.facing_rad)
    steps = round(SHIFTED_M / STEP_M)
    for step in sorted(range(-steps, steps + 1), key=lambda k: (abs(k), -k)):
        point = (x + STEP_M * step * cos, y + STEP_M * step * sin)
        height = seats.carrying(solid, point, target.facing_rad, z)
        at = np.array([point])
        behind = zone_heights(solid, at, ROOM, target.facing_rad)[0] - height
        below = zone_heights(solid, at, CARRYING, target.facing_rad)[0] - height
        carried = (np.abs(below) < UNEVEN_M).mean()
        if abs(height - z) <= MOST_OFF_M and behind.max() < RISEN_M and carried > 0.85:
            return replace(target, point_m=(*point, z))
    return None


def _onto(solid: Relief, target: SeatTarget) -> SeatTarget:
    """The target at the height of the hulls' surface, where that is near."""
    x, y, z = target.point_m
    level = seats.carrying(solid, (x, y), target.facing_rad, z)
    return replace(target, point_m=(x, y, level if abs(level - z) <= MOST_OFF_M else z))


def _lying_onto(solid: Relief, lie: Lying) -> Lying:
    """The lying target with hip and head at the height of the hulls' surface, where that is
    near."""
    ends = []
    for x, y, z in (lie.hip_m, lie.head_m):
        level = affordance.level(solid, (x, y), 0.0, z)
        ends.append((x, y, level if abs(level - z) <= MOST_OFF_M else z))
    return Lying(ends[0], ends[1])
