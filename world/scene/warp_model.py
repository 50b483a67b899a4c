"""One model for all pieces of a bank on mujoco-warp: boxes in box slots, hulls in mesh slots, and
per piece the numbers that differ.

There the type of a geom is the same in all worlds, its size, pose and mesh are not. So the
furniture of the model has as many slots of both kinds as any piece needs. A world without a mesh in
a slot says so by number −1; a box slot that a piece does not use is parked far below the floor.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from world.errors import PieceError
from world.furniture.piece import MOST_HULLS, SLOTS, Piece
from world.scene import slots
from world.scene.box import BOX_BODY, STAND_BODY, is_box
from world.scene.model import (
    FURNITURE_BODY,
    PROJECTILE_BODY,
    SOLID,
    UNUSED,
    Ball,
    scene_spec,
)
from world.scene.slots import Layout

#: Fields of a model that differ between the pieces; the second few only where a box is carried.
GEOM_FIELDS = (
    "geom_size",
    "geom_pos",
    "geom_quat",
    "geom_rbound",
    "geom_aabb",
    "geom_friction",
    "geom_dataid",
)
BODY_FIELDS = (
    "body_mass",
    "body_subtreemass",
    "body_inertia",
    "body_ipos",
    "body_iquat",
    "body_invweight0",
    "dof_invweight0",
)
#: Where unused box slots wait, m, and their half size, m.
_PARKED_M, _TINY_M = -50.0, 1e-3


@dataclass(frozen=True)
class Template:
    """The model of all pieces, and the rows of each."""

    model: mujoco.MjModel
    tables: dict[str, NDArray[np.generic]]
    """By field [V, ...]: what the field holds in a world with that piece."""


def template(models: Sequence[mujoco.MjModel], pieces: Sequence[Piece]) -> Template:
    """The template of V pieces and their compiled scenes.

    Raises PieceError for a piece with more hulls or boxes than there are slots.
    """
    most = max(len(piece.hulls) for piece in pieces)
    for piece in pieces:
        if len(piece.hulls) > MOST_HULLS or (not piece.hulls and len(piece.boxes) > SLOTS):
            raise PieceError(
                f"{piece.name}: {len(piece.hulls)} hulls, {len(piece.boxes)} boxes: --simulator"
                f" warp has slots for {MOST_HULLS} hulls or {SLOTS} boxes"
            )
    model = _compile(models, pieces, most)
    names = (
        GEOM_FIELDS
        if model.body(FURNITURE_BODY).id == model.nbody - 1
        else (GEOM_FIELDS + BODY_FIELDS)
    )
    rows = [_rows(model, models[v], v, len(piece.hulls), names) for v, piece in enumerate(pieces)]
    return Template(model, {name: np.stack([row[name] for row in rows]) for name in names})


def _compile(
    models: Sequence[mujoco.MjModel], pieces: Sequence[Piece], most: int
) -> mujoco.MjModel:
    """The scene of the models with slots for boxes and, beside them, for `most` hulls.

    Which things may collide is one setting for all worlds: that of the models, which agree in it.
    """
    like, bits = models[0], _bits(models)
    cargo = next((piece for piece in pieces if is_box(piece)), None)
    spec = scene_spec(None, _balls(like), cargo, Layout(SLOTS))
    # there the flag means: boxes against boxes by MuJoCo's own routine, several points a pair, not
    # by one deepest point of the general one; meshes go by the general one either way
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_NATIVECCD)
    furniture = spec.body(FURNITURE_BODY)
    for geom in furniture.geoms:
        geom.contype, geom.conaffinity = bits
    if cargo is not None:
        first = int(like.body(STAND_BODY).geomadr[0])
        for geom in spec.body(STAND_BODY).geoms:
            geom.contype = int(like.geom_contype[first])
            geom.conaffinity = int(like.geom_conaffinity[first])
    meshes = [(v, k) for v, piece in enumerate(pieces) for k in range(len(piece.hulls))]
    for v, k in meshes:
        slots.add_hull(spec, _mesh(v, k), pieces[v].hulls[k])
    for k in range(most):
        geom = furniture.add_geom(
            name=f"hull_slot{k}",
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=_mesh(*meshes[0]),
            friction=[1.0, 0.05, 0.001],
        )
        geom.contype, geom.conaffinity = bits
    return spec.compile()


def _bits(models: Sequence[mujoco.MjModel]) -> tuple[int, int]:
    """contype and conaffinity of the used slots, the same in all models; SOLID where none is
    used."""
    found = {
        (int(model.geom_contype[geom]), int(model.geom_conaffinity[geom]))
        for model in models
        for geom in _furniture(model)
    } - {UNUSED}
    if len(found) > 1:
        raise PieceError("--simulator warp: solid pieces beside passable ones in one bank")
    return found.pop() if found else SOLID


def _balls(model: mujoco.MjModel) -> list[Ball]:
    """The projectiles of a compiled scene."""
    names = [model.body(b).name for b in range(model.nbody)]
    found = [b for b, name in enumerate(names) if name.startswith(PROJECTILE_BODY)]
    return [
        Ball(float(model.body_mass[b]), float(model.geom_size[model.body_geomadr[b], 0]))
        for b in found
    ]


def _mesh(variant: int, hull: int) -> str:
    return f"mesh{variant}_{hull}"


def _rows(
    model: mujoco.MjModel, piece: mujoco.MjModel, variant: int, hulls: int, names: Sequence[str]
) -> dict[str, NDArray[np.generic]]:
    """The fields of the template in a world with one piece, taken from the piece's own model."""
    rows = {name: getattr(model, name).copy() for name in names}
    own, there = _furniture(piece), _furniture(model)
    boxes = [g for g in there if model.geom(g).name.startswith("slot")]
    for g in boxes:
        _park(rows, g)
    for g in there[len(boxes) :]:
        rows["geom_dataid"][g] = -1
    for k, source in enumerate(own):
        if piece.geom_contype[source] == UNUSED[0]:
            continue
        target = there[len(boxes) + k] if k < hulls else boxes[k]
        for name in GEOM_FIELDS[:-1]:
            rows[name][target] = getattr(piece, name)[source]
        if k < hulls:
            rows["geom_dataid"][target] = model.mesh(_mesh(variant, k)).id
    for name in names:
        if name in BODY_FIELDS:
            rows[name][:] = getattr(piece, name)
    cargo = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, BOX_BODY)
    if cargo >= 0:
        source = piece.geom(BOX_BODY).id
        for name in GEOM_FIELDS[:-1]:
            rows[name][cargo] = getattr(piece, name)[source]
    return rows


def _furniture(model: mujoco.MjModel) -> list[int]:
    """The geoms of the furniture's body, in order."""
    body = model.body(FURNITURE_BODY)
    first = int(body.geomadr[0])
    return list(range(first, first + int(body.geomnum[0])))


def _park(rows: dict[str, NDArray[np.generic]], geom: int) -> None:
    rows["geom_size"][geom] = _TINY_M
    rows["geom_pos"][geom] = 0.0, 0.0, _PARKED_M
    rows["geom_quat"][geom] = 1.0, 0.0, 0.0, 0.0
    rows["geom_rbound"][geom] = 2.0 * _TINY_M
    rows["geom_aabb"][geom] = 0.0, 0.0, 0.0, _TINY_M, _TINY_M, _TINY_M
