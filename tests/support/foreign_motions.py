"""A clip of the character as another body would have recorded it: names, size, axes, zero pose."""

import json
import warnings
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats import own
from world.motions.formats.recording import Recording, forward

#: Mixamo's names of the character's bodies.
NAMES = (
    "Hips", "Spine", "Head", "RightArm", "RightForeArm", "RightHand", "LeftArm", "LeftForeArm",
    "LeftHand", "RightUpLeg", "RightLeg", "RightFoot", "LeftUpLeg", "LeftLeg", "LeftFoot",
    "RightToeBase", "LeftToeBase",
)  # fmt: skip
#: z up to y up: (x, y, z) -> (y, z, x).
Y_UP = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])


def recorded(clip: Clip, scale: float = 1.15, seed: int = 3) -> Recording:
    """The clip as a recording of somebody `scale` times as large, in cm, y up, whose joints' axes
    are turned against ours by random constants."""
    ours = own.recording(
        Path("walk.x"), clip.fps, clip.root_position_m.astype(float),
        clip.local_rotation.astype(float),
    )  # fmt: skip
    turn = Rotation.random(len(ours.names), random_state=seed).as_matrix()
    return Recording(
        name="walk",
        fps=clip.fps,
        names=NAMES,
        parents=ours.parents,
        position=100.0 * scale * ours.position @ Y_UP.T,
        rotation=Y_UP @ ours.rotation @ turn,
        source="walk.x",
        licence="none",
    )


def write_bvh(
    path: Path,
    root: np.ndarray,
    local: np.ndarray,
    offset: np.ndarray,
    fps: int = 30,
    names: tuple[str, ...] = NAMES,
    parents: tuple[int, ...] = own.PARENTS,
) -> Path:
    """A BVH file of root positions [T, 3] and local rotations [T, J, 3, 3], channels Z X Y."""

    def node(index: int, depth: int) -> list[str]:
        pad = "  " * depth
        children = [i for i, p in enumerate(parents) if p == index]
        kind = "ROOT" if parents[index] < 0 else "JOINT"
        place = "6 Xposition Yposition Zposition" if parents[index] < 0 else "3"
        x, y, z = offset[index]
        lines = [f"{pad}{kind} {names[index]}", pad + "{", f"{pad}  OFFSET {x} {y} {z}",
                 f"{pad}  CHANNELS {place} Zrotation Xrotation Yrotation"]  # fmt: skip
        for child in children:
            order.append(child)
            lines += node(child, depth + 1)
        if not children:
            lines += [f"{pad}  End Site", pad + "  {", f"{pad}    OFFSET 0 0 0", pad + "  }"]
        return [*lines, pad + "}"]

    order = [0]
    text = ["HIERARCHY", *node(0, 0), "MOTION", f"Frames: {len(root)}", f"Frame Time: {1 / fps}"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # any of the angles of a gimbal lock will do
        angles = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_euler("ZXY", degrees=True)
    angles = angles.reshape(len(root), len(names), 3)[:, order].reshape(len(root), -1)
    rows = np.concatenate((root, angles), axis=1)
    text += [" ".join(f"{value:.5f}" for value in row) for row in rows]
    path.write_text("\n".join(text) + "\n")
    return path


def bvh_of(path: Path, clip: Clip, scale: float = 1.1) -> Path:
    """The clip as a BVH file in cm, y up."""
    recording = recorded(clip, scale)
    local = recording.rotation.copy()
    offset = np.zeros((len(NAMES), 3))
    for joint, parent in enumerate(recording.parents):
        if parent >= 0:
            above = np.swapaxes(recording.rotation[:, parent], -1, -2)
            local[:, joint] = above @ recording.rotation[:, joint]
            step = recording.position[:, joint] - recording.position[:, parent]
            offset[joint] = (above @ step[..., None])[0, :, 0]
    return write_bvh(path, recording.position[:, 0], local, offset, clip.fps)


def deepmimic_of(path: Path, clip: Clip) -> Path:
    """The clip as a DeepMimic file: y up, z to the right, knees negative."""
    q = clip.local_rotation.astype(float)
    qpos = clip.qpos().astype(float)
    hinge = dict(zip(("re", "le", "rk", "lk"), qpos[:, list(character.HINGE_QPOS)].T, strict=True))

    def ball(body: str) -> np.ndarray:
        w, x, y, z = q[:, character.BODIES.index(body)].T
        return np.stack((w, x, z, -y), axis=-1)

    x, y, z = clip.root_position_m.astype(float).T
    rows = np.concatenate(
        (
            np.full((clip.frames, 1), 1 / clip.fps), np.stack((x, z, -y), axis=-1),
            ball("pelvis"), ball("torso"), ball("head"),
            ball("right_thigh"), -hinge["rk"][:, None], ball("right_foot"),
            ball("right_upper_arm"), hinge["re"][:, None],
            ball("left_thigh"), -hinge["lk"][:, None], ball("left_foot"),
            ball("left_upper_arm"), hinge["le"][:, None],
        ),
        axis=1,
    )  # fmt: skip
    path.write_text(json.dumps({"Loop": "none", "Frames": rows.tolist()}))
    return path


__all__ = ["NAMES", "bvh_of", "deepmimic_of", "forward", "recorded", "write_bvh"]
