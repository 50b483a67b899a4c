"""Files of a motion on a user's rig: BVH with its hierarchy, glTF with its meshes."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from console.animation import bvh, gltf_file, rig
from console.animation.gltf_file import Writer
from console.animation.retarget import Fitted, onto
from console.animation.rig import Rig, RigError
from console.animation.skeleton import Skeleton
from world.motions.clip import Clip


def content(clip: Clip, suffix: str, path: Path, joint_map: Path | None) -> bytes:
    """Return the content of a file of the suffix, .bvh, .glb or .gltf, with the motion on a rig.

    A BVH may be written of a rig in a glTF file; a glTF file needs one with its meshes. Raises
    RigError in one line.
    """
    require(suffix, path)
    found = rig.read(path)
    fitted = onto(clip, found, found.parts(joint_map))
    if suffix == ".bvh":
        return bvh.written(_for_bvh(fitted)).encode()
    return _gltf(fitted, clip, path, suffix)


def require(suffix: str, path: Path) -> None:
    """Raise RigError for a file of glTF on a rig of BVH."""
    if suffix in gltf_file.SUFFIXES and path.suffix.lower() not in gltf_file.SUFFIXES:
        raise RigError(
            f"--rig {path}: a BVH rig gives .bvh files; for {suffix} give a rig of glTF"
            f" ({' or '.join(gltf_file.SUFFIXES)})"
        )


def _for_bvh(fitted: Fitted) -> Skeleton:
    """Return the motion with end sites as ends, and the root's offset 0 as our files have it."""
    skeleton, found = fitted.skeleton, fitted.rig
    kept = [joint for joint in range(len(found.names)) if joint not in found.ends]
    # several trees in one file: the one that has the body
    tops = {joint: _top(found.parents, joint) for joint in kept}
    kept = [joint for joint in kept if tops[joint] == tops[fitted.hips]]
    place = {joint: index for index, joint in enumerate(kept)}
    offsets = skeleton.offsets[kept]
    offsets[0] = 0.0
    ends = {
        place[found.parents[joint]]: skeleton.offsets[joint]
        for joint in found.ends
        if found.parents[joint] in place
    }
    return Skeleton(
        names=tuple(found.names[joint] for joint in kept),
        parents=tuple(place.get(found.parents[joint], -1) for joint in kept),
        offsets=offsets,
        local=skeleton.local[:, kept],
        moves={place[joint]: at for joint, at in skeleton.moves.items()},
        fps=skeleton.fps,
        ends=ends,
        orders={place[joint]: order for joint, order in found.orders.items() if joint in place},
    )


def _top(parents: tuple[int, ...], joint: int) -> int:
    while parents[joint] >= 0:
        joint = parents[joint]
    return joint


def _gltf(fitted: Fitted, clip: Clip, path: Path, suffix: str) -> bytes:
    """Return the rig's file with the motion as its only animation."""
    document, binary = gltf_file.parsed(path.read_bytes(), path)
    document.pop("animations", None)
    writer = Writer(document, binary)
    skeleton, found = fitted.skeleton, fitted.rig
    times = writer.accessor(np.arange(skeleton.frames) / skeleton.fps, bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []

    def key(node: int, what: str, values: Any) -> None:
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": what}})
        samplers.append({"input": times, "output": writer.accessor(values)})

    above = found.parents[fitted.hips]
    at = fitted.hips_position
    if above >= 0:
        scales = np.ones(len(found.names)) if found.scales is None else found.scales
        at = (at - found.position[above]) @ found.rotation[above] / scales[above]
    for joint, node in enumerate(found.nodes):
        if "matrix" in document["nodes"][node]:
            _decompose(document["nodes"][node])
        if joint in _moved(found, fitted.hips):
            key(node, "rotation", gltf_file.quaternions(skeleton.local[:, joint]))
    key(found.nodes[fitted.hips], "translation", at)
    writer.add("animations", {"name": clip.name, "samplers": samplers, "channels": channels})
    asset = document.setdefault("asset", {"version": "2.0"})
    asset["extras"] = {"motion": clip.source, "motion_licence": clip.licence}
    return writer.content(suffix)


def _moved(found: Rig, hips: int) -> set[int]:
    """Return the hips and the joints below them."""
    moved = {hips}
    for joint, parent in enumerate(found.parents):
        if parent in moved:
            moved.add(joint)
    return moved


def _decompose(node: dict[str, Any]) -> None:
    """Replace the matrix of a node, which animations cannot move, by its parts."""
    matrix = gltf_file.matrix(node)
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    del node["matrix"]
    node["translation"] = matrix[:3, 3].tolist()
    node["rotation"] = Rotation.from_matrix(matrix[:3, :3] / scale).as_quat().tolist()
    node["scale"] = scale.tolist()
