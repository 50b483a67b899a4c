"""Files of rigs of any program: the trees of `support.world.rigs`, standing in an A- or T-pose."""

import struct
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from console.animation.gltf_file import Writer
from tests.support.world.rigs import RIGS, flattened

PARTS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")


def layout(
    kind: str, arm_deg: float = 90.0, height: float = 1.8, thigh: float = 0.26
) -> tuple[tuple[str, ...], tuple[int, ...], np.ndarray]:
    """Names, parents and positions [J, 3] of a rig: x left, y up, z ahead, on a floor at 0.

    Arms are raised by arm_deg from hanging; thigh: its length as a fraction of the height.
    """
    tree, expected, head, sides = RIGS[kind]
    names, parents = flattened(tree)
    arm = np.array([np.sin(np.deg2rad(arm_deg)), -np.cos(np.deg2rad(arm_deg)), 0.0])
    foot, shin = 0.045, 0.24
    known = {head: np.array([0.0, 0.9, 0.01])}
    for side, sign in zip(sides, (-1.0, 1.0), strict=True):
        hip = np.array([sign * 0.055, foot + shin + thigh, 0.0])
        shoulder = np.array([sign * 0.1, 0.82, -0.01])
        flip = np.array([sign, 1.0, 1.0])
        places = (
            hip,
            hip - (0, thigh, -0.005),
            np.array([sign * 0.055, foot, -0.01]),
            np.array([sign * 0.065, 0.012, 0.06]),
            shoulder,
            shoulder + 0.16 * flip * arm + (0, 0, -0.004),
            shoulder + 0.31 * flip * arm,
        )
        for name, place in zip(expected, places, strict=True):
            if name is not None:
                known[name.format(side)] = place
    place = np.full((len(names), 3), np.nan)
    for joint, name in enumerate(names):
        if name in known:
            place[joint] = known[name]
    _fill(names, parents, place)
    return names, parents, height * place


def _fill(names: tuple[str, ...], parents: tuple[int, ...], place: np.ndarray) -> None:
    """Place the other joints: along the trunk and between neighbours, else near the parent."""
    below: dict[int, list[int]] = {joint: [] for joint in range(len(names))}
    for joint, parent in enumerate(parents):
        if parent >= 0:
            below[parent].append(joint)
    for joint, parent in enumerate(parents):
        if not np.isnan(place[joint, 0]):
            continue
        if parent < 0:
            place[joint] = (0.0, 0.56, 0.0)
            continue
        chain, at = [joint], joint
        while len(below[at]) >= 1:
            at = below[at][0]
            chain.append(at)
            if not np.isnan(place[at, 0]):
                break
        end = place[chain[-1]]
        if np.isnan(end[0]):
            place[joint] = place[parent] + (0.01, 0.012, 0.007)
        else:
            place[joint] = place[parent] + (end - place[parent]) / len(chain)


def bvh(path: Path, kind: str, unit: float = 100.0, order: str = "ZXY", **how: float) -> Path:
    """A BVH of a rig without a motion."""
    names, parents, place = layout(kind, **how)

    def lines(joint: int) -> list[str]:
        x, y, z = unit * (place[joint] - (place[parents[joint]] if parents[joint] >= 0 else 0.0))
        word = "JOINT" if parents[joint] >= 0 else "ROOT"
        found = [f"{word} {names[joint]}", "{", f"OFFSET {x:.6f} {y:.6f} {z:.6f}"]
        turns = " ".join(f"{axis}rotation" for axis in order)
        moves = "" if parents[joint] >= 0 else "Xposition Yposition Zposition "
        found.append(f"CHANNELS {6 if moves else 3} {moves}{turns}")
        children = [k for k, parent in enumerate(parents) if parent == joint]
        for child in children:
            found += lines(child)
        if not children:
            found += ["End Site", "{", "OFFSET 0 1 0", "}"]
        return [*found, "}"]

    zeros = " ".join(["0"] * (3 + 3 * len(names)))
    text = ["HIERARCHY", *lines(0), "MOTION", "Frames: 2", "Frame Time: 0.0333333", zeros, zeros]
    path.write_text("\n".join(text) + "\n")
    return path


def glb(path: Path, kind: str, armature: bool = True, **how: float) -> Path:
    """A skinned rig in glTF: joints with axes of their own, below an armature in centimetres with
    z up, as Blender and Mixamo write it; a mesh, an animation and a matrix of its own."""
    names, parents, place = layout(kind, **how)
    turns = Rotation.random(len(names), random_state=5).as_matrix()
    above = np.eye(4)
    if armature:
        above[:3, :3] = 0.01 * Rotation.from_euler("x", -90, degrees=True).as_matrix()
    writer = Writer()
    world = np.tile(np.eye(4), (len(names), 1, 1))
    world[:, :3, :3], world[:, :3, 3] = turns * (0.01 if armature else 1.0), place
    if armature:
        node = {"name": "Armature", "children": [1]}
        writer.add("nodes", node | {"matrix": above.T.reshape(-1).tolist()})
    first = int(armature)
    for joint, parent in enumerate(parents):
        base = world[parent] if parent >= 0 else above
        own = np.linalg.inv(base) @ world[joint]
        node = {"name": names[joint], "translation": own[:3, 3].tolist()}
        node["rotation"] = Rotation.from_matrix(own[:3, :3]).as_quat().tolist()
        children = [first + k for k, other in enumerate(parents) if other == joint]
        writer.add("nodes", node | ({"children": children} if children else {}))
    points = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])
    attributes = {
        "POSITION": writer.accessor(points, bounds=True),
        "JOINTS_0": writer.accessor(np.zeros((3, 4)), "u1"),
        "WEIGHTS_0": writer.accessor(np.tile([1.0, 0, 0, 0], (3, 1))),
    }
    order = writer.accessor(np.array([0, 1, 2]), "u2")
    writer.add("materials", {"name": "cloth"})
    primitive = {"attributes": attributes, "indices": order, "material": 0}
    writer.add("meshes", {"name": "hero", "primitives": [primitive]})
    joints = [first + joint for joint in range(len(names))]
    binds = writer.accessor(np.swapaxes(np.linalg.inv(world), 1, 2))
    writer.add("skins", {"joints": joints, "inverseBindMatrices": binds})
    mesh = writer.add("nodes", {"name": "hero", "mesh": 0, "skin": 0})
    roots = [0 if armature else first]
    writer.document |= {"scene": 0, "scenes": [{"nodes": [*roots, mesh]}]}
    times, keys = np.array([0.0, 1.0]), np.array([[0, 0, 0, 1.0], [0, 0, 1.0, 0]])
    sampler = {"input": writer.accessor(times, bounds=True), "output": writer.accessor(keys)}
    target = {"sampler": 0, "target": {"node": first + 3, "path": "rotation"}}
    writer.add("animations", {"name": "idle", "samplers": [sampler], "channels": [target]})
    content = writer.content(path.suffix)
    assert path.suffix == ".gltf" or struct.unpack_from("<4s", content) == (b"glTF",)
    path.write_bytes(content)
    return path
