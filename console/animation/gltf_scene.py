"""glTF scenes of motions: a skinned character, the objects as nodes, one animation of all.

Metres, y up, the character's +z ahead, as glTF has it. The joints' axes are those of the world in a
T-pose, which is the pose of the nodes before the animation.
"""

from dataclasses import dataclass
from importlib import metadata
from typing import Any

import numpy as np

from console.animation import gltf_file
from console.animation.body_mesh import body_mesh, pose
from console.animation.gltf_file import INDICES, VERTICES, Writer
from console.animation.objects import Object, Shape
from console.animation.skeleton import ROOT, Y_UP, Array, Skeleton, spread
from console.video import stage
from world.character import model as character

#: Roughness of all materials; none is metal.
_ROUGHNESS = 0.85
#: Place of the pelvis of the T-pose and of the mesh, m: thigh, shin and sole.
_STANDING = np.array([0.0, 0.421546 + 0.40987 + 0.05, 0.0])
REFERENCE = "reference"
"""Name of the character that is followed, and prefix of its joints."""


@dataclass(frozen=True)
class Figure:
    """One character: its T-pose skeleton in our axes, and its transparency."""

    skeleton: Skeleton
    name: str = "body"
    opacity: float = 1.0


@dataclass(frozen=True)
class About:
    """Origin of a motion."""

    name: str
    source: str
    licence: str


def content(
    figures: list[Figure], objects: list[Object], fps: float, about: About, suffix: str
) -> bytes:
    """Return the bytes of a file of the suffix, .glb or .gltf."""
    writer = Writer(
        {
            "asset": {
                "version": "2.0",
                "generator": f"inhabit {_version()}",
                "copyright": about.licence,
                "extras": {"source": about.source, "licence": about.licence},
            },
            "scene": 0,
            "scenes": [{"name": about.name, "nodes": []}],
        }
    )
    made = _Scene(writer, len(figures[0].skeleton.local), fps)
    for figure in figures:
        made.figure(figure)
    for one in objects:
        made.object(one)
    made.finish(about.name)
    return writer.content(suffix)


class _Scene:
    """A document under construction, and the channels of its animation."""

    def __init__(self, writer: Writer, frames: int, fps: float) -> None:
        self._writer = writer
        self._times = np.arange(frames) / fps
        self._clock: int | None = None
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        self._materials: dict[tuple[stage.Rgba, float], int] = {}
        self._surface: dict[str, int] | None = None
        self._indices: dict[stage.Rgba, int] = {}

    def figure(self, figure: Figure) -> None:
        """Add a character: its joints, its skinned mesh, and its motion."""
        skeleton = figure.skeleton.turned(Y_UP)
        first = len(self._writer.document.get("nodes", []))
        prefix = "" if figure.name == "body" else f"{figure.name}_"
        for joint, name in enumerate(skeleton.names):
            children = [first + k for k, p in enumerate(skeleton.parents) if p == joint]
            node: dict[str, Any] = {"name": prefix + name}
            node["translation"] = _rest(skeleton, joint).tolist()
            if children:
                node["children"] = children
            self._writer.add("nodes", node)
        for joint in range(len(skeleton.names)):
            turn = gltf_file.quaternions(skeleton.local[:, joint])
            self._key(first + joint, "rotation", turn)
            if joint in skeleton.moves:
                self._key(first + joint, "translation", skeleton.moves[joint])
        bodies = [skeleton.names.index(body) for body in character.BODIES]
        skin = self._writer.add(
            "skins",
            {
                "name": figure.name,
                "skeleton": first,
                "joints": [first + joint for joint in bodies],
                "inverseBindMatrices": self._inverse_binds(),
            },
        )
        mesh = self._writer.add(
            "meshes", {"name": figure.name, "primitives": self._skinned(figure.opacity)}
        )
        shown = self._writer.add("nodes", {"name": figure.name, "mesh": mesh, "skin": skin})
        self._writer.document["scenes"][0]["nodes"] += [first, shown]

    def object(self, one: Object) -> None:
        """Add an object with its motion, if it moves."""
        primitives = [self._primitive(shape) for shape in _merged(one.shapes)]
        mesh = self._writer.add("meshes", {"name": one.name, "primitives": primitives})
        node: dict[str, Any] = {"name": one.name, "mesh": mesh}
        position = one.position @ Y_UP.T
        turn = gltf_file.quaternions(Y_UP @ one.rotation @ Y_UP.T)
        node["translation"], node["rotation"] = position[0].tolist(), turn[0].tolist()
        index = self._writer.add("nodes", node)
        self._writer.document["scenes"][0]["nodes"].append(index)
        if one.moves:
            self._key(index, "translation", position)
            self._key(index, "rotation", turn)
        if one.shown is not None and not one.shown.all():
            # the format cannot hide a node over time: a size of 0 does
            self._key(
                index, "scale", np.repeat(one.shown[:, None].astype(np.float64), 3, axis=1), "STEP"
            )

    def finish(self, name: str) -> None:
        """Add the animation."""
        self._writer.add(
            "animations", {"name": name, "samplers": self._samplers, "channels": self._channels}
        )

    def _key(self, node: int, path: str, values: Array, how: str = "LINEAR") -> None:
        if self._clock is None:
            self._clock = self._writer.accessor(self._times, bounds=True)
        target = {"node": node, "path": path}
        self._channels.append({"sampler": len(self._samplers), "target": target})
        output = self._writer.accessor(values)
        self._samplers.append({"input": self._clock, "output": output, "interpolation": how})

    def _inverse_binds(self) -> int:
        """Return the accessor of the matrices from the mesh to each joint in the mesh's pose."""
        position, turns = pose()
        found = np.tile(np.eye(4), (len(position), 1, 1))
        for body, name in enumerate(character.BODIES):
            # the joint's axes are turned with the body, from those of the world in a T-pose
            axes = Y_UP @ turns[body] @ spread(name).T @ Y_UP.T
            found[body, :3, :3] = axes.T
            found[body, :3, 3] = -axes.T @ (Y_UP @ position[body] + _STANDING)
        return self._writer.accessor(np.swapaxes(found, -1, -2))

    def _skinned(self, opacity: float) -> list[dict[str, Any]]:
        """Return the primitives of the body, one for each colour, over the same vertices."""
        mesh = body_mesh()
        if self._surface is None:
            add = self._writer.accessor
            self._surface = {
                "POSITION": add(mesh.vertices @ Y_UP.T + _STANDING, target=VERTICES, bounds=True),
                "NORMAL": add(_unit(mesh.normals @ Y_UP.T), target=VERTICES),
                "JOINTS_0": add(mesh.bodies, "u1", VERTICES),
                "WEIGHTS_0": add(mesh.weights, target=VERTICES),
            }
            kind = "u2" if len(mesh.vertices) < 0xFFFF else "u4"
            self._indices = {
                colour: add(faces.reshape(-1), kind, INDICES)
                for colour, faces in mesh.faces.items()
            }
        return [
            {"attributes": self._surface, "indices": index, "material": self._material(c, opacity)}
            for c, index in self._indices.items()
        ]

    def _primitive(self, shape: Shape) -> dict[str, Any]:
        add = self._writer.accessor
        kind = "u2" if len(shape.vertices) < 0xFFFF else "u4"
        return {
            "attributes": {
                "POSITION": add(shape.vertices @ Y_UP.T, target=VERTICES, bounds=True),
                "NORMAL": add(_unit(shape.normals @ Y_UP.T), target=VERTICES),
            },
            "indices": add(shape.faces.reshape(-1), kind, INDICES),
            "material": self._material(shape.colour, 1.0),
        }

    def _material(self, colour: stage.Rgba, opacity: float) -> int:
        key = colour, opacity
        if key not in self._materials:
            entry: dict[str, Any] = {
                "name": _NAMES.get(colour, f"colour_{len(self._materials)}"),
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*_linear(colour), opacity],
                    "metallicFactor": 0.0,
                    "roughnessFactor": _ROUGHNESS,
                },
            }
            if opacity < 1.0:
                entry |= {"name": f"{REFERENCE}_{entry['name']}", "alphaMode": "BLEND"}
            self._materials[key] = self._writer.add("materials", entry)
        return self._materials[key]


_NAMES = {
    **{tuple(round(x, 4) for x in colour): name for name, colour in stage.CLOTHES.items()},
    stage.BOX: "box",
    **{colour: name for name, colour in stage.FURNITURE.items()},
}


def _rest(skeleton: Skeleton, joint: int) -> Array:
    """Return the place [3] of a joint in its parent in the T-pose, standing at the origin."""
    pelvis = skeleton.names.index(character.BODIES[0])
    if joint == pelvis:
        return _STANDING
    return skeleton.offsets[joint] if skeleton.names[joint] != ROOT else np.zeros(3)


def _merged(shapes: tuple[Shape, ...]) -> list[Shape]:
    """Return one shape for each colour."""
    found = []
    for colour in dict.fromkeys(shape.colour for shape in shapes):
        same = [shape for shape in shapes if shape.colour == colour]
        starts = np.cumsum([0, *(len(shape.vertices) for shape in same[:-1])])
        found.append(
            Shape(
                np.concatenate([shape.vertices for shape in same]),
                np.concatenate([shape.normals for shape in same]),
                np.concatenate([s.faces + at for s, at in zip(same, starts, strict=True)]),
                colour,
            )
        )
    return found


def _linear(colour: stage.Rgba) -> list[float]:
    """Return the linear red, green and blue of an sRGB colour."""
    value = np.array(colour[:3])
    low, high = value / 12.92, ((value + 0.055) / 1.055) ** 2.4
    return [round(float(x), 5) for x in np.where(value <= 0.04045, low, high)]


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)


def _version() -> str:
    try:
        return metadata.version("inhabit")
    except metadata.PackageNotFoundError:
        return ""
