"""Flags of the files for animation programs and engines."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class AnimationFlags:
    """How a motion is written for animation programs."""

    rest: Literal["hanging", "t-pose"] | None = None
    """Pose of a .bvh where all its rotations are 0: arms hanging (default) or a T-pose; .glb and
    .gltf always have a T-pose."""
    root_motion: bool = False
    """Add a joint `root` on the floor below the pelvis, with its travel and heading; .bvh, .glb and
    .gltf."""
    rig: Path | None = None
    """FILE.bvh, .glb or .gltf of your own skeleton: a .bvh gets the motion on it; a .glb or .gltf
    is that file with the motion as its animation."""
    joint_map: Path | None = None
    """JSON file that names joints of the rig by part of the body, where their names are not
    understood: {"left_knee": "Bone.012"}."""
