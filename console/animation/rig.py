"""Rigs, the skeletons of users: joints at rest, from a BVH or glTF file."""

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from console.animation import gltf_file
from console.animation.skeleton import Array
from world.errors import ClipError, ConfigError
from world.motions.formats import bvh, bvh_text, landmarks
from world.motions.text import decoded
from world.refusals import reason, refusing, unknown_suffix

SUFFIXES = (".bvh", ".glb", ".gltf")
_MAX_BYTES = 256 * 1024 * 1024
#: Frames of a BVH's motion among which a pose of rest is looked for, where it has none.
_MOST_FRAMES = 100
#: Longest chain of joints.
_MOST_LEVELS = 200
#: Toes nearer to the ankle than this fraction of the leg are none.
_NO_TOE = 0.02


class RigError(ConfigError):
    """A rig that cannot be used."""


@dataclass(frozen=True)
class Rig:
    """A skeleton of J joints at rest, in the axes and the unit of its file."""

    name: str
    """File, for messages."""
    names: tuple[str, ...]
    parents: tuple[int, ...]
    """Each joint's parent, before its children; -1 for roots."""
    position: Array
    """[J, 3]: in the file's world, at rest."""
    rotation: Array
    """[J, 3, 3]: in the file's world, at rest."""
    orders: dict[int, str] = field(default_factory=dict)
    """Order of the rotations of a BVH's joints."""
    ends: frozenset[int] = frozenset()
    """End sites of a BVH, which do not turn."""
    motion: tuple[Array, Array] | None = None
    """Positions [T, J, 3] and rotations [T, J, 3, 3] of frames of a BVH's own motion."""
    nodes: tuple[int, ...] = ()
    """Nodes of a glTF file, by joint."""
    scales: Array | None = None
    """[J]: scale of each joint's axes in the world, of a glTF file."""

    def parts(self, joint_map: Path | None) -> dict[str, int]:
        """Return the joint of each part of the body, by the words of its name or by a map file.

        Raises ClipError, which names the parts without a joint and the joints that are there.
        """
        whose = f"--rig {self.name}"
        try:
            given = {} if joint_map is None else landmarks.read_map(joint_map).joints
            found = landmarks.among(self.names, self.parents, whose, given)
        except ClipError as error:
            text = str(error).replace("a --map file", "a --joint-map file")
            text = text if text.startswith(whose) else f"--joint-map {text}"
            raise RigError(text) from error
        for side in landmarks.SIDES:
            toe = found.get(f"{side}_toe")
            if toe is None:
                continue
            ankle, knee = (self.position[found[f"{side}_{part}"]] for part in ("ankle", "knee"))
            if np.linalg.norm(self.position[toe] - ankle) < _NO_TOE * np.linalg.norm(knee - ankle):
                del found[f"{side}_toe"]
        return found


def read(path: Path) -> Rig:
    """Return the rig of a file. Raises RigError in one line."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise RigError(f"--rig {path}: {unknown_suffix(path)}; choose {', '.join(SUFFIXES)}")
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise RigError(f"--rig {path}: at most {_MAX_BYTES // 2**20} MiB are read")
        content = path.read_bytes()
    except OSError as error:
        raise RigError(f"--rig {path}: {error.strerror or error}") from error
    with refusing(RigError, Path(f"--rig {path}"), "rig"):
        found = of_bvh(path, content) if suffix == ".bvh" else of_gltf(path, content)
        _bounded(found)
        return found


def _bounded(found: Rig) -> None:
    """Raise RigError for more joints, or a longer chain of them, than a person can have."""
    if len(found.names) > bvh_text.MAX_JOINTS:
        raise RigError(
            f"--rig {found.name}: {len(found.names)} joints; at most {bvh_text.MAX_JOINTS} are read"
        )
    levels: list[int] = []
    for parent in found.parents:
        levels.append(levels[parent] + 1 if parent >= 0 else 0)
    if levels and max(levels) > _MOST_LEVELS:
        raise RigError(f"--rig {found.name}: a chain of {max(levels)} joints is no person")


def of_bvh(path: Path, content: bytes) -> Rig:
    """Return the rig of a BVH file, at rest where all its rotations are 0."""
    try:
        joints = bvh_text.hierarchy(decoded(content))
    except ValueError as error:
        raise RigError(f"--rig {path}: not a readable BVH file ({reason(error)})") from error
    position = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints):
        # the root's is where it stands, or 0
        above = position[joint.parent] if joint.parent >= 0 else 0.0
        position[index] = above + np.array(joint.offset)
    motion = None
    with suppress(ClipError):  # a rig needs no motion
        read_motion = bvh.read(path)
        step = max(1, read_motion.frames // _MOST_FRAMES)
        if len(read_motion.names) == len(joints):
            motion = read_motion.position[::step], read_motion.rotation[::step]
    turns = {i: [c[1] for c in j.channels if c[0] == "r"] for i, j in enumerate(joints)}
    orders = {i: "".join(axes) for i, axes in turns.items() if sorted(axes) == ["x", "y", "z"]}
    return Rig(
        name=str(path),
        names=tuple(joint.name for joint in joints),
        parents=tuple(joint.parent for joint in joints),
        position=position,
        rotation=np.tile(np.eye(3), (len(joints), 1, 1)),
        orders=orders,
        ends=frozenset(i for i, joint in enumerate(joints) if joint.is_end),
        motion=motion,
    )


def of_gltf(path: Path, content: bytes) -> Rig:
    """Return the rig of a glTF file: the joints of its skins with the nodes above them, else all
    nodes, at the rest of the nodes."""
    try:
        document, _ = gltf_file.parsed(content, path)
    except ClipError as error:
        raise RigError(f"--rig {error}") from error
    nodes = document.get("nodes", [])
    above = {child: index for index, node in enumerate(nodes) for child in node.get("children", [])}
    wanted = {joint for skin in document.get("skins", []) for joint in skin["joints"]}
    if not wanted:
        wanted = set(range(len(nodes)))
    for joint in list(wanted):
        node = joint
        while node in above and above[node] not in wanted:
            node = above[node]
            wanted.add(node)
    order, world = _placed(nodes, above, wanted, path)
    place = {node: index for index, node in enumerate(order)}
    linear = np.array([world[node][:3, :3] for node in order])
    scales = np.linalg.norm(linear, axis=1)
    if len(order) and not (np.linalg.det(linear) > 0).all():
        raise RigError(f"--rig {path}: a joint is mirrored (negative scale)")
    if len(order) and (scales.max(axis=1) > 1.01 * scales.min(axis=1)).any():
        odd = order[int(np.argmax(scales.max(axis=1) / scales.min(axis=1)))]
        name = nodes[odd].get("name", odd)
        raise RigError(f"--rig {path}: the joint {name} is scaled differently along its axes")
    return Rig(
        name=str(path),
        names=tuple(str(nodes[node].get("name", f"node{node}")) for node in order),
        parents=tuple(place[above[node]] if node in above else -1 for node in order),
        position=np.array([world[node][:3, 3] for node in order]).reshape(-1, 3),
        rotation=linear / scales.mean(axis=1)[:, None, None],
        nodes=tuple(order),
        scales=scales.mean(axis=1),
    )


def _placed(
    nodes: list[dict[str, object]], above: dict[int, int], wanted: set[int], path: Path
) -> tuple[list[int], dict[int, Array]]:
    """Return the wanted nodes, parents before their children, and their matrices in the world."""
    order, world = [], {}
    waiting = sorted(node for node in wanted if node not in above)
    while waiting:
        node = waiting.pop(0)
        if node in world:
            raise RigError(f"--rig {path}: node {node} has two parents")
        own = gltf_file.matrix(nodes[node])
        world[node] = world[above[node]] @ own if node in above else own
        order.append(node)
        waiting = [n for n in nodes[node].get("children", []) if n in wanted] + waiting  # pyright: ignore
    return order, world
