"""A recorded trial as data of the page's viewer: shapes on bodies, and body poses over time."""

import base64
from functools import cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.evaluation.stepping import Track
from console.recording.format import Take, pose
from console.video import stage
from world.character import model as character

#: Positions are stored as millimetres, rotations in 1/32767, both in 16 bits.
_PER_M, _UNIT = 1000.0, 32767.0
_KINDS = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}


def drawable(track: Track, every: int = 1) -> dict[str, Any]:
    """Return a track as JSON values: hz, frames, shapes, errors and, in base64, poses [T, B, 7]
    int16; of every so many frames."""
    data = drawn(
        track.model,
        body_poses(track)[::every],
        track.error_m[::every],
        -(-track.steps // every),
        track.take.piece,
    )
    return data | {"hz": character.CONTROL_HZ / every}


def drawn(
    model: mujoco.MjModel,
    poses: NDArray[np.float64],
    error_m: NDArray[Any],
    end: int,
    piece: str = "",
    ghost: NDArray[np.float64] | None = None,
) -> dict[str, Any]:
    """Return the same of poses [T, nbody, 7] of a model, errors [T] m, the first step that is not
    evaluated, and the name of the furniture, whose class gives its colour.

    ghost: coordinates [T, 43] of the character that is followed, drawn translucent."""
    shapes, bodies = shapes_of(model, piece)
    shown = poses[:, bodies]
    if ghost is not None:
        shown = np.concatenate((shown, character_poses(ghost)), axis=1)
        shapes = [*shapes, *_ghost(len(bodies))]
    return {
        "hz": character.CONTROL_HZ,
        "frames": len(poses),
        "shapes": shapes,
        "bodies": shown.shape[1],
        "root": bodies.index(model.body(character.BODIES[0]).id),
        "poses": packed(shown),
        "error": [round(float(x), 3) for x in error_m],
        "end": end,
    }


def shapes_of(
    model: mujoco.MjModel, piece: str = "", look: stage.Shapes = "body"
) -> tuple[list[dict[str, Any]], list[int]]:
    """Return the visible shapes without the floor, each with the index of its body in the list of
    bodies.

    piece: name of the furniture; furniture, boxes and balls then have the colours of films.
    look: body, a rounded character in clothes; shapes, its collision shapes.
    """
    shapes: list[dict[str, Any]] = []
    bodies: list[int] = []
    clothed = _clothed() if look == "body" else {}
    for number in range(model.nbody):
        found = clothed.get(model.body(number).name)
        if found is None:
            found = _shapes_on(model, number)
            if piece and model.body(number).name not in character.BODIES:
                colour = _rounded(np.array(stage.colour_of(model, number, piece)[:3]))
                found = [shape | {"rgb": colour} for shape in found]
        if found:
            shapes += [shape | {"body": len(bodies)} for shape in found]
            bodies.append(number)
    return shapes, bodies


def _shapes_on(model: mujoco.MjModel, body: int, group: int | None = None) -> list[dict[str, Any]]:
    """Return the visible shapes of a body, all or of one group of geoms."""
    shapes: list[dict[str, Any]] = []
    first = int(model.body_geomadr[body])
    for geom in range(first, first + int(model.body_geomnum[body])):
        kind = _KINDS.get(int(model.geom_type[geom]))
        rgba = model.geom_rgba[geom]
        hidden = group is not None and int(model.geom_group[geom]) != group
        if kind is None or rgba[3] == 0.0 or hidden:
            continue
        shape: dict[str, Any] = {
            "kind": kind,
            "size": _rounded(model.geom_size[geom]),
            "pos": _rounded(model.geom_pos[geom]),
            "quat": _rounded(model.geom_quat[geom]),
            "rgb": _rounded(rgba[:3]),
        }
        if kind == "mesh":
            shape |= _mesh(model, int(model.geom_dataid[geom]))
        shapes.append(shape)
    return shapes


@cache
def _clothed() -> dict[str, list[dict[str, Any]]]:
    """Return the shapes of the rounded character by body."""
    model = stage.character_alone()
    return {name: _shapes_on(model, model.body(name).id, stage.SHOWN) for name in character.BODIES}


def body_poses(track: Track) -> NDArray[np.float64]:
    """Return positions (m) and rotations (w, x, y, z) of the model's bodies, [T, nbody, 7]."""
    return poses_of(track.model, track.take)


def poses_of(model: mujoco.MjModel, take: Take) -> NDArray[np.float64]:
    """Return the same of a take, model: of its scene."""
    data = mujoco.MjData(model)
    poses = np.zeros((len(take), model.nbody, 7))
    for frame in range(len(take)):
        pose(model, data, take, frame)
        poses[frame, :, :3], poses[frame, :, 3:] = data.xpos, data.xquat
    return poses


def character_poses(qpos: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses [T, 15, 7] of the character's bodies in coordinates [T, 43]."""
    model = stage.character_alone()
    data = mujoco.MjData(model)
    rows = [model.body(name).id for name in character.BODIES]
    poses = np.zeros((len(qpos), len(rows), 7))
    for frame, coordinates in enumerate(qpos):
        data.qpos[: character.NQ] = coordinates
        mujoco.mj_kinematics(model, data)
        poses[frame, :, :3], poses[frame, :, 3:] = data.xpos[rows], data.xquat[rows]
    return poses


def _ghost(first: int) -> list[dict[str, Any]]:
    """Return the shapes of a followed character whose bodies begin at `first`."""
    clothed = _clothed()
    return [
        shape | {"body": first + number, "rgb": [*stage.GHOST[:3]], "ghost": True}
        for number, name in enumerate(character.BODIES)
        for shape in clothed[name]
    ]


def packed(poses: NDArray[np.float64]) -> str:
    """Return poses [T, B, 7] as base64 of little-endian int16."""
    whole = np.concatenate(
        (np.clip(poses[..., :3] * _PER_M, -_UNIT, _UNIT), poses[..., 3:] * _UNIT), axis=-1
    )
    return base64.b64encode(whole.round().astype("<i2").tobytes()).decode()


def _mesh(model: mujoco.MjModel, mesh: int) -> dict[str, list[float]]:
    start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    first, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return {
        "vertices": _rounded(model.mesh_vert[start : start + count].ravel()),
        "faces": model.mesh_face[first : first + faces].ravel().tolist(),
    }


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [round(float(x), 4) for x in values]
