"""The objects of a scene for files: triangles with a colour, and places over time."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from console.animation.skeleton import Array
from console.recording.format import Take, pose
from console.video import stage
from world.character import model as character
from world.motions.objects import BoxTrack
from world.scene.box import BOX_BODY, STAND_BODY
from world.scene.model import FURNITURE_BODY, PROJECTILE_BODY

#: Faces of a box: corners as signs, anticlockwise from outside.
_QUADS = (
    ((1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)),
    ((-1, 1, -1), (-1, -1, -1), (-1, -1, 1), (-1, 1, 1)),
    ((1, 1, -1), (-1, 1, -1), (-1, 1, 1), (1, 1, 1)),
    ((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)),
    ((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)),
    ((-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1)),
)
#: Squares of a sphere along a meridian.
_RINGS = 12
#: Moves and turns below this, m and in a quaternion, are none.
_STILL = 1e-6


@dataclass(frozen=True)
class Shape:
    """Triangles of one colour, in the object's frame, m."""

    vertices: Array
    """[n, 3]."""
    normals: Array
    """[n, 3], of unit length, outwards."""
    faces: NDArray[np.int64]
    """[m, 3], anticlockwise from outside."""
    colour: stage.Rgba
    """sRGB."""


@dataclass(frozen=True)
class Object:
    """One object over T frames, in our axes."""

    name: str
    shapes: tuple[Shape, ...]
    position: Array
    """[T, 3] m."""
    rotation: Array
    """[T, 3, 3]."""
    shown: NDArray[np.bool_] | None = None
    """[T]; None: always."""

    @property
    def moves(self) -> bool:
        """Whether it is displaced or turned at some time."""
        return bool(
            np.ptp(self.position, axis=0).max() > _STILL
            or np.ptp(self.rotation, axis=0).max() > _STILL
        )


def of_take(take: Take, model: mujoco.MjModel, mesh: Shape | None = None) -> list[Object]:
    """Return the objects of a take, with the shapes of the simulator's model of its scene.

    mesh: the furniture's own surface, in its frame, instead of its collision shapes.
    """
    data = mujoco.MjData(model)
    bodies = [
        body
        for body in range(1, model.nbody)
        if model.body(body).name not in character.BODIES and _shapes(model, body, take.piece)
    ]
    positions = np.empty((len(take), len(bodies), 3))
    rotations = np.empty((len(take), len(bodies), 3, 3))
    for frame in range(len(take)):
        pose(model, data, take, frame)
        positions[frame] = data.xpos[bodies]
        rotations[frame] = data.xmat[bodies].reshape(-1, 3, 3)
    found = []
    for column, body in enumerate(bodies):
        name = model.body(body).name
        shapes = _shapes(model, body, take.piece)
        one = Object(name, shapes, positions[:, column], rotations[:, column])
        if name == FURNITURE_BODY:
            one = replace(one, name=take.piece or name)
            if mesh is not None:
                colour = shapes[0].colour
                one = replace(one, shapes=(replace(mesh, colour=colour),))
            elif len(take.cargo):
                one = replace(_above_the_floor(one), name="first_stand")
        elif name == STAND_BODY:
            one = replace(_above_the_floor(one), name="target_stand")
        elif name.startswith(PROJECTILE_BODY):
            one = _thrown(one, take, int(name.removeprefix(PROJECTILE_BODY)))
        found.append(one)
    return found


def of_box(track: BoxTrack) -> Object:
    """Return the carried box of a clip."""
    pose_of = track.pose.astype(np.float64)
    turn = Rotation.from_quat(pose_of[:, 3:], scalar_first=True).as_matrix()
    half = 0.5 * np.array(track.size_m)
    return Object(BOX_BODY, (solid_box(np.zeros(3), half, np.eye(3), stage.BOX),),
                  pose_of[:, :3], turn)  # fmt: skip


def solid_box(centre: Array, half: Array, turn: Array, colour: stage.Rgba) -> Shape:
    """Return a box with flat faces."""
    corners = np.array(_QUADS, np.float64)
    normals = np.repeat(corners.mean(axis=1), 4, axis=0) @ turn.T
    vertices = centre + (corners.reshape(-1, 3) * half) @ turn.T
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(6)[:, None, None] + halves).reshape(-1, 3)
    return Shape(vertices, normals, faces, colour)


def surface(vertices: Array, faces: NDArray[np.int64], colour: stage.Rgba) -> Shape:
    """Return triangles with flat faces; those without area are left out."""
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(cross, axis=1)
    kept = size > 1e-12
    normals = np.repeat(cross[kept] / size[kept, None], 3, axis=0)
    flat = corners[kept].reshape(-1, 3)
    return Shape(flat, normals, np.arange(len(flat)).reshape(-1, 3), colour)


def _sphere(centre: Array, radius: float, colour: stage.Rgba) -> Shape:
    down = np.linspace(0.0, np.pi, _RINGS + 1)
    round_ = np.linspace(0.0, 2 * np.pi, 2 * _RINGS + 1)
    a, b = (grid.ravel() for grid in np.meshgrid(down, round_, indexing="ij"))
    normals = np.stack((np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)), axis=1)
    width = 2 * _RINGS + 1
    ring, step = (g.ravel() for g in np.mgrid[0:_RINGS, 0 : 2 * _RINGS])
    here = ring * width + step
    quads = np.stack((here, here + width, here + width + 1, here + 1), axis=1)
    upper, lower = quads[ring < _RINGS - 1], quads[ring > 0]
    faces = np.concatenate((upper[:, [0, 1, 2]], lower[:, [0, 2, 3]]))
    return Shape(centre + radius * normals, normals, faces, colour)


def _shapes(model: mujoco.MjModel, body: int, piece: str) -> tuple[Shape, ...]:
    """Return the visible shapes of a body."""
    colour = stage.colour_of(model, body, piece)
    found = []
    first = int(model.body_geomadr[body])
    for geom in range(first, first + int(model.body_geomnum[body])):
        if model.geom_rgba[geom][3] == 0.0:
            continue
        centre, size = model.geom_pos[geom], model.geom_size[geom]
        turn = Rotation.from_quat(model.geom_quat[geom], scalar_first=True).as_matrix()
        kind = int(model.geom_type[geom])
        if kind == mujoco.mjtGeom.mjGEOM_BOX:
            found.append(solid_box(centre, size, turn, colour))
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            found.append(_sphere(centre, float(size[0]), colour))
        elif kind == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = int(model.geom_dataid[geom])
            start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
            at, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            vertices = centre + model.mesh_vert[start : start + count] @ turn.T
            triangles = model.mesh_face[at : at + faces].astype(np.int64)
            found.append(surface(vertices.astype(np.float64), triangles, colour))
        else:
            raise AssertionError(f"a shape of kind {kind} in {model.body(body).name}")
    return tuple(found)


def _above_the_floor(one: Object) -> Object:
    """Return a stand whose column, which extends below the floor in the simulator, ends on it."""
    floor = -float(one.position[0, 2])
    return replace(
        one,
        shapes=tuple(
            replace(
                shape,
                vertices=np.maximum(shape.vertices, np.array([-np.inf, -np.inf, floor])),
            )
            for shape in one.shapes
        ),
    )


def _thrown(one: Object, take: Take, index: int) -> Object:
    """Return a ball that stays where it was last while it is out of the scene."""
    shown: NDArray[np.bool_] = np.isfinite(take.balls[:, index]).min(axis=1)
    last = np.maximum.accumulate(np.where(shown, np.arange(len(shown)), -1))
    last[last < 0] = int(np.argmax(shown))
    return replace(one, position=one.position[last], rotation=one.rotation[last], shown=shown)
