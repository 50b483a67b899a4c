"""A self-contained page that plays motion clips with their objects and source skeletons."""

import base64
import json
from collections.abc import Sequence
from importlib import resources
from typing import Any

import mujoco
import numpy as np

from world.character import kinematics
from world.character import model as character
from world.motions import segments
from world.motions.clip import Clip

_SLOT = '/*DATA*/{"bodies":[],"clips":[]}'
#: Depth and width of the block that stands for a seat of known height alone, and of such a bed's
#: mattress, m; distance from the head to the end of the bed, m.
_SEAT_M = (0.44, 0.48)
_BED_M = (2.0, 0.9)
_PILLOW_M = 0.3
_BAD = 4


def page(clips: Sequence[Clip]) -> str:
    """Return the HTML of the page, with the clips."""
    template = resources.files("console.motions").joinpath("page.html").read_text()
    data = {
        "bodies": bodies(),
        "stages": segments.NAMES,
        "clips": [shown(clip) for clip in clips],
    }
    # "</" ends a script element
    return template.replace(_SLOT, json.dumps(data).replace("</", "<\\/"))


def bodies() -> list[dict[str, Any]]:
    """Return the character's bodies: parent, offset (m), and geoms of the MuJoCo model."""
    model = character.spec().compile()
    names = {
        int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
        int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
        int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    }
    table = []
    for index, name in enumerate(character.BODIES):
        geoms = [
            {
                "type": names[int(model.geom_type[g])],
                "size": model.geom_size[g].tolist(),
                "pos": model.geom_pos[g].tolist(),
                "quat": model.geom_quat[g].tolist(),
            }
            for g in np.flatnonzero(model.geom_bodyid == model.body(name).id)
        ]
        offset = kinematics.offsets()[index].tolist()
        table.append({"parent": character.PARENTS[index], "offset_m": offset, "geoms": geoms})
    return table


def shown(clip: Clip) -> dict[str, Any]:
    """Return a clip as JSON values: arrays as little-endian base64, rotations in 1/32767."""
    rotation = np.round(clip.local_rotation * 32767.0).astype("<i2")
    stage = segments.stages(clip) + _BAD * ~segments.usable(clip)
    content: dict[str, Any] = {
        "name": clip.name,
        "fps": clip.fps,
        "frames": clip.frames,
        "source": clip.source,
        "licence": clip.licence,
        "root_m": _packed(clip.root_position_m.astype("<f4")),
        "rotation": _packed(rotation),
        "stages": _packed(stage.astype("u1")),
        "furniture": furniture(clip),
    }
    if clip.box is not None:
        half = [0.5 * edge for edge in clip.box.size_m]
        content["box"] = {"pose_m": _packed(clip.box.pose.astype("<f4")), "half_m": half}
    if clip.ghost is not None:
        position = np.clip(np.round(clip.ghost.position_m * 1000.0), -32767, 32767)
        content["ghost"] = {
            "parents": clip.ghost.parents,
            "position_mm": _packed(position.astype("<i2")),
        }
    return content


def furniture(clip: Clip) -> list[dict[str, Any]]:
    """Return blocks for the seat and bed of a clip: centre and half edges (m), yaw (rad)."""
    blocks = []
    if clip.seat is not None:
        x, y, z = clip.seat.point_m
        depth, width = _SEAT_M
        blocks.append(_block((x, y), z, (depth, width), clip.seat.facing_rad))
    if clip.bed is not None:
        hip, head = np.array(clip.bed.hip_m), np.array(clip.bed.head_m)
        along = (head - hip)[:2] / max(float(np.linalg.norm((head - hip)[:2])), 1e-6)
        long, wide = _BED_M
        side = np.array([np.cos(clip.bed.facing_rad), np.sin(clip.bed.facing_rad)])
        centre = head[:2] + (_PILLOW_M - 0.5 * long) * along - 0.1 * side
        blocks.append(
            _block(centre, clip.bed.height_m, (long, wide), float(np.arctan2(along[1], along[0])))
        )
    return blocks


def _block(
    centre: Sequence[float] | np.ndarray, height_m: float, edges_m: tuple[float, float], yaw: float
) -> dict[str, Any]:
    half = [0.5 * edges_m[0], 0.5 * edges_m[1], 0.5 * height_m]
    return {
        "centre_m": [float(centre[0]), float(centre[1]), 0.5 * height_m],
        "half_m": half,
        "yaw_rad": yaw,
    }


def _packed(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()
