"""The motion of a take as a clip, without its scene."""

import numpy as np
import torch
from numpy.typing import NDArray

from console.recording.format import Take
from world.character import kinematics
from world.character import model as character
from world.motions.clip import Clip
from world.motions.objects import BoxTrack


def clip_of(
    take: Take,
    name: str,
    source: str,
    licence: str,
    fps: int = character.CONTROL_HZ,
    held: NDArray[np.bool_] | None = None,
) -> Clip:
    """Return the motion of a take as a clip, with its carried box if any.

    held: [T], whether the hands hold the box; None: at no time.
    """
    return Clip(
        name=name,
        fps=fps,
        root_position_m=take.qpos[:, :3].astype(np.float32),
        local_rotation=_local(take.qpos),
        source=source,
        licence=licence,
        box=_box(take, np.zeros(len(take), np.bool_) if held is None else held),
    )


def reference_of(take: Take, clip: Clip) -> Clip | None:
    """Return the motion of the reference that a take follows, as a clip; None where it has none."""
    if not len(take.ghost):
        return None
    return Clip(
        name=f"{clip.name}-reference",
        fps=clip.fps,
        root_position_m=take.ghost[:, :3].astype(np.float32),
        local_rotation=_local(take.ghost),
        source=clip.source,
        licence=clip.licence,
    )


def _local(qpos: NDArray[np.float64]) -> NDArray[np.float32]:
    own = torch.from_numpy(np.ascontiguousarray(qpos[:, : character.NQ]))
    return kinematics.local_rotations(own).float().numpy()


def _box(take: Take, held: NDArray[np.bool_]) -> BoxTrack | None:
    if not len(take.cargo):
        return None
    x, y, z = (2.0 * take.cargo).tolist()
    return BoxTrack(take.qpos[:, character.NQ :].astype(np.float32), (x, y, z), held)
