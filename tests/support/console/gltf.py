"""A reader of glTF 2.0 of the tests' own: the rules of the specification, poses and skinning.

It shares no code with the writer: containers by struct, matrices of nodes by 4 x 4 products,
quaternions by scipy.
"""

import base64
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

KINDS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass
class File:
    """A file's JSON and buffer."""

    json: dict[str, Any]
    binary: bytes
    issues: list[str] = field(default_factory=list)
    """Rules that it breaks."""

    def values(self, index: int) -> np.ndarray:
        """The numbers of an accessor [n, k]."""
        entry = self.json["accessors"][index]
        view = self.json["bufferViews"][entry["bufferView"]]
        kind, width = np.dtype(KINDS[entry["componentType"]]), WIDTHS[entry["type"]]
        start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
        assert "byteStride" not in view
        count = entry["count"] * width
        found = np.frombuffer(self.binary, kind, count, start).reshape(-1, width)
        return found.astype(np.float64)

    def node(self, name: str) -> int:
        (found,) = [i for i, n in enumerate(self.json["nodes"]) if n.get("name") == name]
        return found

    def times(self) -> np.ndarray:
        """The times of the keys, s: those of the first sampler."""
        return self.values(self.json["animations"][0]["samplers"][0]["input"])[:, 0]

    def world(self, at_s: float | None) -> np.ndarray:
        """Matrices [nodes, 4, 4] in the world at a time; None: before the animation."""
        nodes = self.json["nodes"]
        parts = [
            {
                "translation": np.array(n.get("translation", (0, 0, 0)), float),
                "rotation": np.array(n.get("rotation", (0, 0, 0, 1)), float),
                "scale": np.array(n.get("scale", (1, 1, 1)), float),
            }
            for n in nodes
        ]
        if at_s is not None:
            animation = self.json["animations"][0]
            for channel in animation["channels"]:
                sampler = animation["samplers"][channel["sampler"]]
                keys, values = self.values(sampler["input"])[:, 0], self.values(sampler["output"])
                target = channel["target"]
                how = sampler.get("interpolation", "LINEAR")
                parts[target["node"]][target["path"]] = sampled(
                    keys, values, at_s, how, target["path"]
                )
        own = np.tile(np.eye(4), (len(nodes), 1, 1))
        for index, part in enumerate(parts):
            if "matrix" in nodes[index]:
                own[index] = np.array(nodes[index]["matrix"], float).reshape(4, 4).T
                continue
            turn = Rotation.from_quat(part["rotation"]).as_matrix()
            own[index, :3, :3] = turn @ np.diag(part["scale"])
            own[index, :3, 3] = part["translation"]
        found = np.full((len(nodes), 4, 4), np.nan)

        def visit(index: int, above: np.ndarray) -> None:
            found[index] = above @ own[index]
            for child in nodes[index].get("children", []):
                visit(child, found[index])

        for root in self.json["scenes"][self.json["scene"]]["nodes"]:
            visit(root, np.eye(4))
        return found

    def skinned(self, mesh: str, at_s: float | None) -> np.ndarray:
        """Vertices [n, 3] of a skinned mesh at a time."""
        node = self.json["nodes"][self.node(mesh)]
        skin = self.json["skins"][node["skin"]]
        world = self.world(at_s)[skin["joints"]]
        binds = self.values(skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
        moved = world @ binds
        attributes = self.json["meshes"][node["mesh"]]["primitives"][0]["attributes"]
        at = np.pad(self.values(attributes["POSITION"]), ((0, 0), (0, 1)), constant_values=1.0)
        joints = self.values(attributes["JOINTS_0"]).astype(int)
        weights = self.values(attributes["WEIGHTS_0"])
        each = np.einsum("nkij,nj->nki", moved[joints], at)[..., :3]
        return np.einsum("nk,nki->ni", weights, each)


def sampled(keys: np.ndarray, values: np.ndarray, at_s: float, how: str, path: str) -> np.ndarray:
    """The value of a channel at a time."""
    at_s = float(np.clip(at_s, keys[0], keys[-1]))
    if how == "STEP":
        return values[int(np.searchsorted(keys, at_s + 1e-9, "right")) - 1]
    if path == "rotation":
        return Slerp(keys, Rotation.from_quat(values))(at_s).as_quat()
    return np.array([np.interp(at_s, keys, column) for column in values.T])


def read(path: Path) -> File:
    """The file, with what it breaks of the specification in `issues`."""
    content = path.read_bytes()
    issues: list[str] = []
    if path.suffix == ".glb":
        magic, version, length = struct.unpack_from("<4sII", content)
        if (magic, version, length) != (b"glTF", 2, len(content)):
            issues.append("header")
        size, kind = struct.unpack_from("<I4s", content, 12)
        if kind != b"JSON" or size % 4:
            issues.append("first chunk")
        text, rest = content[20 : 20 + size], content[20 + size :]
        size, kind = struct.unpack_from("<I4s", rest)
        if kind != b"BIN\0" or size % 4 or len(rest) != 8 + size:
            issues.append("second chunk")
        found = File(json.loads(text), rest[8 : 8 + size], issues)
    else:
        document = json.loads(content)
        uri = document["buffers"][0]["uri"]
        head, _, data = uri.partition(",")
        if head != "data:application/octet-stream;base64":
            issues.append("data URI")
        found = File(document, base64.b64decode(data), issues)
    _check(found)
    return found


def _check(file: File) -> None:
    document, say = file.json, file.issues.append
    if document["asset"]["version"] != "2.0":
        say("asset.version")
    if document["buffers"][0]["byteLength"] > len(file.binary):
        say("buffer length")
    for index, view in enumerate(document["bufferViews"]):
        if view["byteOffset"] + view["byteLength"] > document["buffers"][0]["byteLength"]:
            say(f"view {index} beyond the buffer")
    for index, entry in enumerate(document["accessors"]):
        view = document["bufferViews"][entry["bufferView"]]
        size = np.dtype(KINDS[entry["componentType"]]).itemsize
        if (view["byteOffset"] + entry.get("byteOffset", 0)) % size:
            say(f"accessor {index} is not aligned")
        if view.get("target") == 34962 and view["byteOffset"] % 4:
            say(f"attribute {index} is not aligned to 4")
        if entry["count"] * WIDTHS[entry["type"]] * size > view["byteLength"]:
            say(f"accessor {index} beyond its view")
        values = file.values(index)
        if not np.isfinite(values).all():
            say(f"accessor {index} is not finite")
        for key, real in (("min", values.min(axis=0)), ("max", values.max(axis=0))):
            if key in entry and not np.array_equal(np.float32(entry[key]), np.float32(real)):
                say(f"accessor {index}: {key}")
    _check_meshes(file)
    _check_nodes(file)
    for animation in document.get("animations", []):
        _check_animation(file, animation)
    names = [n.get("name") for n in document["nodes"]]
    if len(set(names)) != len(names):
        say("two nodes have one name")


def _check_meshes(file: File) -> None:
    say = file.issues.append
    for mesh in file.json.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            accessors = file.json["accessors"]
            counts = {accessors[a]["count"] for a in attributes.values()}
            if len(counts) != 1:
                say("attributes of several lengths")
            if not {"min", "max"} <= accessors[attributes["POSITION"]].keys():
                say("POSITION without bounds")
            used = file.values(primitive["indices"])
            if len(used) % 3 or used.max() >= counts.pop():
                say("indices")
            if accessors[primitive["indices"]]["componentType"] not in (5121, 5123, 5125):
                say("kind of indices")
            if "NORMAL" in attributes:
                length = np.linalg.norm(file.values(attributes["NORMAL"]), axis=1)
                if np.abs(length - 1).max() > 1e-4:
                    say("a NORMAL is not of unit length")
            if "WEIGHTS_0" in attributes:
                weights = file.values(attributes["WEIGHTS_0"])
                joints = file.values(attributes["JOINTS_0"])
                if np.abs(weights.sum(axis=1) - 1).max() > 1e-5 or weights.min() < 0:
                    say("weights")
                if joints[weights == 0].any():
                    say("a joint without weight is not 0")
            if not 0 <= primitive.get("material", 0) < len(file.json["materials"]):
                say("material")


def _check_nodes(file: File) -> None:
    document, say = file.json, file.issues.append
    children = [child for node in document["nodes"] for child in node.get("children", [])]
    if len(set(children)) != len(children):
        say("a node has two parents")
    roots = document["scenes"][document["scene"]]["nodes"]
    if set(roots) & set(children) or len(set(roots)) != len(roots):
        say("a root of the scene is no root")
    if np.isnan(file.world(None)).any():
        say("a node is in no scene, or in a circle")
    for node in document["nodes"]:
        if "rotation" in node and abs(np.linalg.norm(node["rotation"]) - 1) > 1e-4:
            say("rotation of a node")
    for skin in document.get("skins", []):
        binds = file.values(skin["inverseBindMatrices"])
        if len(binds) != len(skin["joints"]) or len(set(skin["joints"])) != len(skin["joints"]):
            say("joints of a skin")
        # column-major: the last row of the matrix is 0 0 0 1
        if not np.array_equal(binds[:, [3, 7, 11, 15]], np.tile([0, 0, 0, 1.0], (len(binds), 1))):
            say("inverse bind matrices")


def _check_animation(file: File, animation: dict[str, Any]) -> None:
    say = file.issues.append
    targets = [(c["target"]["node"], c["target"]["path"]) for c in animation["channels"]]
    if len(set(targets)) != len(targets):
        say("a target of two channels")
    for node, _ in targets:
        if "matrix" in file.json["nodes"][node]:
            say("an animated node has a matrix")
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        keys, values = file.values(sampler["input"]), file.values(sampler["output"])
        if keys.shape[1] != 1 or (np.diff(keys[:, 0]) <= 0).any() or keys[0] < 0:
            say("times of keys")
        if not {"min", "max"} <= file.json["accessors"][sampler["input"]].keys():
            say("times without bounds")
        width = {"translation": 3, "rotation": 4, "scale": 3}[channel["target"]["path"]]
        if len(keys) != len(values) or values.shape[1] != width:
            say("values of keys")
        if channel["target"]["path"] == "rotation":
            if np.abs(np.linalg.norm(values, axis=1) - 1).max() > 1e-4:
                say("rotations of keys")
            if (np.sum(values[1:] * values[:-1], axis=1) < 0).any():
                say("a rotation changes its sign")
