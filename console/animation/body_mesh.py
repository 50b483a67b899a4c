"""The rounded character as one skinned surface: vertices, faces by colour, and weights of bodies.

Its shapes are those of the display model (`console.video.stage`), blended where they meet: a smooth
union of signed distances (Blinn 1982, "A Generalization of Algebraic Surface Drawing"), meshed by
surface nets (Gibson 1998). It is made in a T-pose with the legs apart, where no limb touches
another.
"""

from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from console.animation.skeleton import Array, spread
from console.video import stage
from world.character import kinematics
from world.character import model as character

#: Edge of the grid, m, and radius over which shapes and weights are blended, m.
GRID_M, _BLEND_M, _WEIGHT_M = 0.015, 0.008, 0.018
ARM_DEG, LEG_DEG = 90.0, 9.0
"""Angles of arms and legs from hanging straight, in the pose of the mesh."""
#: A shape counts to this distance from its surface, m.
_REACH_M = 0.06
_MOST_WEIGHTS = 4
_PROJECTIONS, _STEP_M = 3, 1e-4


@dataclass(frozen=True)
class BodyMesh:
    """A closed surface of n vertices in the pose of `pose()`, our axes, m."""

    vertices: Array
    """[n, 3]."""
    normals: Array
    """[n, 3], of unit length, outwards."""
    faces: dict[stage.Rgba, NDArray[np.int64]]
    """Triangles [m, 3] by colour (sRGB), anticlockwise from outside."""
    bodies: NDArray[np.int64]
    """[n, 4]: bodies that move a vertex."""
    weights: Array
    """[n, 4]: their weights, of sum 1, the largest first."""


def pose() -> tuple[Array, Array]:
    """Return positions [15, 3] m and rotations [15, 3, 3] of the bodies in the pose of the mesh,
    with the pelvis at the origin."""
    turns = np.stack([spread(body, ARM_DEG, LEG_DEG) for body in character.BODIES])
    offsets, position = kinematics.offsets().double().numpy(), np.zeros((len(turns), 3))
    for body, parent in enumerate(character.PARENTS):
        if parent >= 0:
            position[body] = position[parent] + turns[parent] @ offsets[body]
    return position, turns


@dataclass(frozen=True)
class _Shape:
    """An ellipsoid or capsule of a body."""

    kind: int
    body: int
    colour: stage.Rgba
    centre: Array
    turn: Array
    size: Array

    def distance(self, points: Array) -> Array:
        """Signed distance [n] of points [n, 3], m; exact for capsules, to first order for
        ellipsoids."""
        own = (points - self.centre) @ self.turn
        if self.kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            radius, half = self.size[:2]
            own[:, 2] -= np.clip(own[:, 2], -half, half)
            return np.linalg.norm(own, axis=1) - radius
        near = np.linalg.norm(own / self.size, axis=1)
        slope = np.maximum(np.linalg.norm(own / self.size**2, axis=1), 1e-9)
        return near * (near - 1.0) / slope

    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner [3] of a box around the shape, m."""
        if self.kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach = self.size[0] + self.size[1] * np.abs(self.turn[:, 2])
        else:
            reach = np.linalg.norm(self.turn * self.size, axis=1)
        return self.centre - reach, self.centre + reach


@cache
def body_mesh() -> BodyMesh:
    """Return the surface of the rounded character."""
    shapes = _shapes()
    vertices, faces = _nets(*_grid(shapes))
    distance = _distances(shapes, vertices)
    for _ in range(_PROJECTIONS):
        slope = _gradient(shapes, vertices)
        vertices = vertices - _union(distance)[:, None] * slope / np.sum(
            slope * slope, axis=1, keepdims=True
        )
        distance = _distances(shapes, vertices)
    vertices, by_colour = _cut_by_colour(shapes, vertices, faces, distance)
    distance = _distances(shapes, vertices)
    normals = _gradient(shapes, vertices)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    bodies, weights = _weights(shapes, distance)
    return BodyMesh(vertices, normals, by_colour, bodies, weights)


def _shapes() -> list[_Shape]:
    """Return the shapes of the display model in the pose of the mesh."""
    model, (position, turns) = stage.character_alone("body"), pose()
    found = []
    for geom in np.flatnonzero(model.geom_group == stage.SHOWN):
        body = character.BODIES.index(model.body(int(model.geom_bodyid[geom])).name)
        own = Rotation.from_quat(model.geom_quat[geom], scalar_first=True).as_matrix()
        r, g, b, a = (round(float(value), 4) for value in model.geom_rgba[geom])
        found.append(
            _Shape(
                kind=int(model.geom_type[geom]),
                body=body,
                colour=(r, g, b, a),
                centre=position[body] + turns[body] @ model.geom_pos[geom],
                turn=turns[body] @ own,
                size=model.geom_size[geom].copy(),
            )
        )
    return found


def _grid(shapes: list[_Shape]) -> tuple[Array, Array]:
    """Return the lowest point [3] of a grid and the values of the union at its points [x, y, z]."""
    lows, highs = zip(*(shape.bounds() for shape in shapes), strict=True)
    low = np.min(lows, axis=0) - 4 * GRID_M
    count = np.ceil((np.max(highs, axis=0) + 4 * GRID_M - low) / GRID_M).astype(int) + 1
    total = np.zeros(count)
    for shape in shapes:
        near, far = shape.bounds()
        first = np.maximum(np.floor((near - _REACH_M - low) / GRID_M).astype(int), 0)
        last = np.minimum(np.ceil((far + _REACH_M - low) / GRID_M).astype(int) + 1, count)
        axes = [low[i] + GRID_M * np.arange(first[i], last[i]) for i in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        value = np.exp(-shape.distance(points.reshape(-1, 3)) / _BLEND_M)
        total[tuple(slice(a, b) for a, b in zip(first, last, strict=True))] += value.reshape(
            points.shape[:3]
        )
    return low, -_BLEND_M * np.log(np.maximum(total, np.exp(-_REACH_M / _BLEND_M)))


def _distances(shapes: list[_Shape], points: Array) -> Array:
    """Signed distances [n, shapes] of points [n, 3]."""
    return np.stack([shape.distance(points) for shape in shapes], axis=1)


def _union(distance: Array) -> Array:
    """The smooth union [n] of signed distances [n, shapes]."""
    least = distance.min(axis=1)
    total = np.exp(-(distance - least[:, None]) / _BLEND_M).sum(axis=1)
    return least - _BLEND_M * np.log(total)


def _gradient(shapes: list[_Shape], points: Array) -> Array:
    """Gradient [n, 3] of the union at points [n, 3], by central differences."""
    found = np.empty_like(points)
    for axis in range(3):
        step = _STEP_M * np.eye(3)[axis]
        ahead, behind = (_union(_distances(shapes, points + s)) for s in (step, -step))
        found[:, axis] = (ahead - behind) / (2 * _STEP_M)
    return found


def _nets(low: Array, values: Array) -> tuple[Array, NDArray[np.int64]]:
    """Surface nets: a vertex in each cell of the grid that the surface crosses, at the mean of the
    crossings of its edges, and two triangles for each edge of the grid that it crosses."""
    inside = values < 0
    corners = [np.array([x, y, z]) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    cells = np.array(values.shape) - 1

    def corner(array: NDArray[Any], at: Array) -> NDArray[Any]:
        return array[tuple(slice(int(a), int(a) + int(n)) for a, n in zip(at, cells, strict=True))]

    sum_of = np.zeros((*cells, 3))
    crossings = np.zeros(cells, int)
    for axis in range(3):
        for start in corners:
            if start[axis]:
                continue
            end = start + np.eye(3, dtype=int)[axis]
            a, b = corner(values, start), corner(values, end)
            crossed = corner(inside, start) != corner(inside, end)
            part = np.where(crossed, a / np.where(crossed, a - b, 1.0), 0.0)
            crossings += crossed
            for k in range(3):
                sum_of[..., k] += crossed * (start[k] + (part if k == axis else 0.0))
    used = crossings > 0
    index = np.full(cells, -1)
    index[used] = np.arange(int(used.sum()))
    where = np.argwhere(used) + sum_of[used] / crossings[used][:, None]
    faces = []
    for axis in range(3):
        one, two = (axis + 1) % 3, (axis + 2) % 3
        a = np.take(inside, np.arange(values.shape[axis] - 1), axis)
        b = np.take(inside, np.arange(1, values.shape[axis]), axis)
        for outwards, crossed in ((True, a & ~b), (False, ~a & b)):
            at = np.argwhere(crossed)
            at = at[(at[:, one] > 0) & (at[:, two] > 0)]
            unit = np.eye(3, dtype=int)
            around = (at - unit[one] - unit[two], at - unit[two], at, at - unit[one])
            quad = np.stack([index[tuple(cell.T)] for cell in around], axis=1)
            quad = quad if outwards else quad[:, ::-1]
            faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return low + GRID_M * where, np.concatenate(faces)


def _cut_by_colour(
    shapes: list[_Shape], vertices: Array, faces: NDArray[np.int64], distance: Array
) -> tuple[Array, dict[stage.Rgba, NDArray[np.int64]]]:
    """Cut triangles where the nearest shape changes its colour; return the vertices with those of
    the cuts, and the triangles by colour."""
    colours = sorted({shape.colour for shape in shapes})
    of = np.array([colours.index(shape.colour) for shape in shapes])
    near = np.stack([distance[:, of == k].min(axis=1) for k in range(len(colours))], axis=1)
    own = near.argmin(axis=1)
    kind = own[faces]
    alike = (kind[:, 0] == kind[:, 1]) & (kind[:, 1] == kind[:, 2])
    three = (kind[:, 0] != kind[:, 1]) & (kind[:, 1] != kind[:, 2]) & (kind[:, 0] != kind[:, 2])
    whole = alike | three
    parts, labels = [faces[whole]], [kind[whole, 0]]
    mixed, kinds = faces[~whole], kind[~whole]
    # the corner of its own colour goes first
    odd = np.where(kinds[:, 1] == kinds[:, 2], 0, np.where(kinds[:, 0] == kinds[:, 2], 1, 2))
    turn = (odd[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(mixed, turn, axis=1).T
    edges = np.sort(np.concatenate((np.stack((a, b), 1), np.stack((a, c), 1))), axis=1)
    unique, place = np.unique(edges, axis=0, return_inverse=True)
    first, second = own[unique[:, 0]], own[unique[:, 1]]
    rows = np.arange(len(unique))
    start, end = near[unique[:, 0]], near[unique[:, 1]]
    before, after = (end_[rows, second] - end_[rows, first] for end_ in (start, end))
    fraction = np.clip(before / np.maximum(before - after, 1e-12), 0.0, 1.0)[:, None]
    cuts = vertices[unique[:, 0]] * (1 - fraction) + vertices[unique[:, 1]] * fraction
    p, q = np.split(len(vertices) + place.reshape(-1), 2)
    parts += [np.stack((a, p, q), 1), np.stack((p, b, c), 1), np.stack((p, c, q), 1)]
    labels += [own[a], own[b], own[b]]
    triangles, label = np.concatenate(parts), np.concatenate(labels)
    return np.concatenate((vertices, cuts)), {
        colour: triangles[label == k] for k, colour in enumerate(colours)
    }


def _weights(shapes: list[_Shape], distance: Array) -> tuple[NDArray[np.int64], Array]:
    """Return bodies and weights [n, 4]: of the nearest body and its neighbours in the tree, less
    the further away they are."""
    count = len(character.BODIES)
    of = np.array([shape.body for shape in shapes])
    near = np.stack([distance[:, of == body].min(axis=1) for body in range(count)], axis=1)
    linked = np.eye(count, dtype=bool)
    for body, parent in enumerate(character.PARENTS):
        if parent >= 0:
            linked[body, parent] = linked[parent, body] = True
    nearest = near.argmin(axis=1)
    weight = np.exp(-(near - near.min(axis=1, keepdims=True)) / _WEIGHT_M) * linked[nearest]
    bodies = np.argsort(-weight, axis=1)[:, :_MOST_WEIGHTS]
    kept = np.take_along_axis(weight, bodies, axis=1)
    kept[kept < 0.01] = 0.0
    kept /= kept.sum(axis=1, keepdims=True)
    return np.where(kept > 0, bodies, 0), kept
