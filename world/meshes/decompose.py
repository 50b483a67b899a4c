"""Decomposition of a mesh into convex hulls, the simulator's collision shapes."""

import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.furniture.piece import Box, Hull, Vector

PARTS = 10
"""Greatest number of hulls of a mesh: 16 carry no better, and each costs time in every step of
every scene, also with other pieces (docs/results/furniture.md)."""
MOST_VERTICES = 24
"""Greatest number of vertices of a hull."""
VOXELS = 100_000
"""Voxels of the decomposition: edges of about 1 cm on a chair, 2.5 cm on a sofa, before the hulls
are shrunk onto the mesh."""
THINNEST_M = 0.004
"""Least thickness of a hull; flatter ones are thickened, since contacts need a volume."""

Points = NDArray[np.float64]


def hulls(triangles_m: Points, name: str = "piece", voxels: int = VOXELS) -> tuple[Hull, ...]:
    """At most PARTS hulls of triangles [m, 3, 3] m, by V-HACD (Mamou 2016, vhacdx)."""
    import vhacdx

    vertices, index = np.unique(triangles_m.reshape(-1, 3).round(6), axis=0, return_inverse=True)
    faces = index.reshape(-1, 3)
    solid = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])
    solid &= faces[:, 0] != faces[:, 2]
    counted = np.column_stack((np.full(int(solid.sum()), 3), faces[solid]))
    parts = vhacdx.compute_vhacd(
        np.ascontiguousarray(vertices),
        counted.ravel().astype(np.uint32),
        maxConvexHulls=PARTS,
        maxNumVerticesPerCH=MOST_VERTICES,
        resolution=voxels,
        asyncACD=False,
    )
    found = [closed(np.asarray(points, dtype=np.float64)) for points, _ in parts]
    kept = tuple(hull for hull in found if hull is not None)
    if not kept:
        raise PieceError(f"{name}: no solid part in it")
    return kept


def closed(points: Points) -> Hull | None:
    """The convex hull of points [n, 3] m, faces outwards; None for degenerate points."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 3:
        return None
    points = _thickened(points)
    try:
        found = ConvexHull(points)
    except QhullError:
        return None
    used = np.unique(found.simplices)
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    faces = found.simplices.copy()
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), found.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    if found.volume < 1e-9:
        return None
    return Hull(
        tuple(vector(p) for p in points[used]),
        tuple((int(i), int(j), int(k)) for i, j, k in number[faces]),
    )


def lowered(hull: Hull, top_m: float) -> Hull | None:
    """A hull cut at top_m, with its upper points projected down to that height, so that a seat
    keeps its extent. None where nothing solid is left."""
    points = np.array(hull.vertices_m)
    above = points[:, 2] > top_m
    if not above.any():
        return hull
    upper, lower = points[above], points[~above]
    fraction = (top_m - lower[:, None, 2]) / (upper[None, :, 2] - lower[:, None, 2])
    cut = lower[:, None] + fraction[..., None] * (upper[None] - lower[:, None])
    pressed = np.column_stack((upper[:, :2], np.full(len(upper), top_m)))
    return closed(np.concatenate((lower, cut.reshape(-1, 3), pressed)))


def _thickened(points: Points) -> Points:
    """The points, thickened along their thinnest direction where it is below THINNEST_M."""
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=True)
    along = (points - centre) @ axes[2]
    if float(np.ptp(along)) >= THINNEST_M:
        return points
    offset = THINNEST_M / 2 * axes[2]
    return np.concatenate((points - offset, points + offset))


def around(hull: Hull) -> Box:
    """The box around a hull: along its principal directions, or upright where that is smaller."""
    points = np.array(hull.vertices_m)
    _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)
    if np.linalg.det(axes) < 0.0:
        axes[2] = -axes[2]
    choices = [_box(points, axes), _box(points, np.eye(3))]
    return min(choices, key=lambda box: float(np.prod(box.half_m)))


def _box(points: Points, axes: Points) -> Box:
    from scipy.spatial.transform import Rotation

    local = points @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    w, x, y, z = Rotation.from_matrix(axes.T).as_quat(scalar_first=True).tolist()
    return Box(vector(axes.T @ ((low + high) / 2)), vector((high - low) / 2), (w, x, y, z))


def vector(array: Points) -> Vector:
    """Three coordinates, rounded to 0.1 µm."""
    x, y, z = (round(float(v), 7) for v in array)
    return x, y, z


def mass_properties(
    hulls: tuple[Hull, ...], density_kg_m3: float, least_kg: float = 0.0
) -> tuple[float, Points, Points]:
    """Mass in kg, centre of mass [3] m and inertia about it [3, 3] kg m² of uniform hulls, which
    are denser where their mass would be below `least_kg`.

    Overlaps count twice. By the covariance of each hull's tetrahedra (Blow and Binstock 2004).
    """
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    canonical = (np.ones((3, 3)) + np.eye(3)) / 120.0
    for hull in hulls:
        corners = np.array(hull.vertices_m)[np.array(hull.faces)]
        volume = np.linalg.det(corners) / 6.0
        mass += float(volume.sum())
        first += (volume[:, None] * corners.mean(axis=1) * 0.75).sum(axis=0)
        second += np.einsum("n,nki,kl,nlj->ij", 6.0 * volume, corners, canonical, corners)
    density_kg_m3 = max(density_kg_m3, least_kg / mass)
    mass *= density_kg_m3
    centre = density_kg_m3 * first / mass
    covariance = density_kg_m3 * second - mass * np.outer(centre, centre)
    return mass, centre, np.trace(covariance) * np.eye(3) - covariance
