"""A small file of every format that the program reads, with its reader."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from console.animation import bvh
from console.recording import format as recordings
from console.run.directory import RunDirectory
from console.run.experiment import PRESETS, read_experiment, to_json
from console.run.metrics import read_metrics
from policy.checkpoints import format as checkpoints
from world.character import model as character
from world.furniture.piece import Box
from world.meshes import importing, source, store, sweethome
from world.meshes.build import ImportOptions
from world.motions import cache, clip_file, load, plausible
from world.motions.clip import Clip
from world.motions.formats import landmarks, omomo, own, registry
from world.motions.retarget.convert import retargeted
from world.motions.synthetic import library

FRAMES = 12
_BONES = (
    ("lhipjoint", "root", "0.3 -0.1 0"), ("rhipjoint", "root", "-0.3 -0.1 0"),
    ("lfemur", "lhipjoint", "0 -1 0"), ("ltibia", "lfemur", "0 -1 0"), ("lfoot", "ltibia", "0 0 1"),
    ("rfemur", "rhipjoint", "0 -1 0"), ("rtibia", "rfemur", "0 -1 0"), ("rfoot", "rtibia", "0 0 1"),
    ("thorax", "root", "0 1 0"), ("head", "thorax", "0 1 0"),
    ("lclavicle", "thorax", "0.5 0 0"), ("rclavicle", "thorax", "-0.5 0 0"),
    ("lhumerus", "lclavicle", "1 0 0"), ("lradius", "lhumerus", "1 0 0"),
    ("lhand", "lradius", "1 0 0"),
    ("rhumerus", "rclavicle", "-1 0 0"), ("rradius", "rhumerus", "-1 0 0"),
    ("rhand", "rradius", "-1 0 0"),
)  # fmt: skip
_CUBE = [[x, y, z] for x in (-0.25, 0.25) for y in (-0.25, 0.25) for z in (0.0, 0.5)]
_FACES = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
    [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
]  # fmt: skip


@dataclass(frozen=True)
class Sample:
    """A file of one format."""

    name: str
    """Name of the file, whose suffix readers use."""
    content: bytes
    read: Callable[[Path], Any]
    kind: str = "bytes"
    """Encoding: bytes, text, json, signed (json with a digest), zip, pickle, npy (a pickle with a
    header) or msgpack."""
    beside: tuple[tuple[str, bytes], ...] = ()
    """Names and contents of files in the same folder."""


def samples(folder: Path) -> dict[str, Sample]:
    """Return a sample of each format by name; `folder`: for temporary files."""
    return _motions(folder) | _meshes(folder) | _others(folder)


def motion(path: Path) -> Clip:
    """Read a motion as `motions import` does."""
    recording = registry.read(path)
    clip = retargeted(recording)
    plausible.implausible(clip, recording.fps)
    return clip


def pickled(content: Any) -> bytes:
    """Return a pickle of plain data and arrays."""
    return np.array(content, dtype=object).dumps()


def headed(content: Any) -> bytes:
    """Return a .npy file of one pickled object."""
    import io

    file = io.BytesIO()
    kind = {"descr": "|O", "fortran_order": False, "shape": ()}
    np.lib.format.write_array_header_1_0(file, kind)
    return file.getvalue() + pickled(content)


def _walk() -> Clip:
    return library.walking(np.random.default_rng(0), 1.0).part(60, 60 + FRAMES)


def _motions(folder: Path) -> dict[str, Sample]:
    clip = _walk()
    clip_file.write(folder / "clip.npz", clip)
    cache.write(folder / "cache.npz", (clip, clip))
    poses, trans = np.zeros((FRAMES, 156)), np.zeros((FRAMES, 3))
    trans[:, 2] = 0.95
    np.savez(folder / "amass.npz", poses=poses, trans=trans, mocap_framerate=np.array(120.0))
    row = [1 / 30, 0.0, 0.9, 0.0] + [1.0, 0, 0, 0] * 4 + [-0.1] + [1.0, 0, 0, 0] * 2 + [0.1]
    row += [1.0, 0, 0, 0] + [-0.1] + [1.0, 0, 0, 0] * 2 + [0.1]
    tree = {
        "node_names": list(character.BODIES),
        "parent_indices": {"arr": np.array(character.PARENTS), "context": {"dtype": "int64"}},
        "local_translation": {"arr": own.offsets().astype(np.float32), "context": {}},
    }
    turned = np.tile(np.array([0, 0, 0, 1.0], np.float32), (FRAMES, 15, 1))
    poselib = {
        "rotation": {"arr": turned, "context": {"dtype": "float32"}},
        "root_translation": {"arr": trans.astype(np.float32), "context": {}},
        "skeleton_tree": tree, "fps": 30, "is_local": True,
    }  # fmt: skip
    samp = {"pose_est_fullposes": np.zeros((FRAMES, 165)), "pose_est_trans": trans,
            "mocap_framerate": 120.0}  # fmt: skip
    frames = np.zeros((FRAMES, 34))
    frames[:, 2] = 0.9
    asf, amc = _acclaim()
    return {
        "bvh": Sample("a.bvh", bvh.text(clip).encode(), motion, "text"),
        "amc": Sample("a.amc", amc, motion, "text", (("a.asf", asf),)),
        "asf": Sample("a.asf", asf, lambda p: motion(p.with_suffix(".amc")), "text",
                      (("a.amc", amc),)),
        "deepmimic": Sample(
            "a.txt", json.dumps({"Loop": "none", "Frames": [row] * FRAMES}).encode(), motion, "json"
        ),
        "amass": Sample("a.npz", (folder / "amass.npz").read_bytes(), motion, "zip"),
        "clip": Sample("a.npz", (folder / "clip.npz").read_bytes(), motion, "zip"),
        "clip-trained": Sample("a.npz", (folder / "clip.npz").read_bytes(), load.read, "zip"),
        "cache": Sample("a.npz", (folder / "cache.npz").read_bytes(), cache.read, "zip"),
        "samp": Sample("a.pkl", pickled(samp), motion, "pickle"),
        "mimickit": Sample(
            "a.pkl", pickled({"frames": frames, "fps": 30, "loop_mode": 0}), motion, "pickle"
        ),
        "poselib": Sample("a.npy", headed(poselib), motion, "npy"),
        "omomo": Sample("sub1_largebox_1.pt", _omomo(), motion, "zip"),
        "map": Sample(
            "a.json", b'{"left_knee": "LeftLeg", "unit_m": 0.01, "up": "y"}', landmarks.read_map,
            "json",
        ),
    }  # fmt: skip


def _omomo() -> bytes:
    """Return a torch tensor of OMOMO's columns: a person at rest beside a box."""
    import io

    rows = np.zeros((FRAMES, omomo.COLUMNS), np.float32)
    at = np.zeros((len(omomo.NAMES), 3))
    for index, (name, parent) in enumerate(zip(omomo.NAMES, omomo.parents(), strict=True)):
        left = {"L": 1.0, "R": -1.0}.get(name[0], 0.0) * (0.15 if "_" in name else 0.0)
        down = -0.4 if name.endswith(("Knee", "Ankle")) else 0.1 if "_" not in name else -0.02
        at[index] = (at[parent] if parent >= 0 else (0, 0, 0.9)) + np.array([0.02, left, down])
    rows[:, 162:318] = at.reshape(-1)
    rows[:, 318:321] = 0.5, 0.0, 0.2
    rows[:, 324] = rows[:, 6] = 1.0
    rows[:, 386::4] = 1.0
    file = io.BytesIO()
    torch.save(torch.from_numpy(rows), file)
    return file.getvalue()


def _acclaim() -> tuple[bytes, bytes]:
    """Return an ASF skeleton and an AMC motion."""
    lines = [":version 1.10", ":name a", ":units", "mass 1.0", "length 0.45", "angle deg", ":root",
             "order TX TY TZ RX RY RZ", "axis XYZ", "position 0 0 0", "orientation 0 0 0",
             ":bonedata"]  # fmt: skip
    for index, (name, _, along) in enumerate(_BONES):
        lines += ["begin", f"id {index + 1}", f"name {name}", f"direction {along}", "length 8.0",
                  "axis 0 0 0 XYZ", "dof rx ry rz", "limits (-160 20)", "end"]  # fmt: skip
    lines += [":hierarchy", "begin"]
    for parent in dict.fromkeys(parent for _, parent, _ in _BONES):
        lines.append(" ".join([parent, *(n for n, p, _ in _BONES if p == parent)]))
    lines.append("end")
    moves = [":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(FRAMES):
        moves += [str(frame + 1), f"root 0 18.5 {frame / 10} 0 0 0"]
        moves += [f"{name} {frame} 5 5" for name, _, _ in _BONES]
    return "\n".join(lines).encode(), "\n".join(moves).encode()


def _meshes(folder: Path) -> dict[str, Sample]:
    import io
    import zipfile

    import trimesh

    cube = trimesh.Trimesh(np.array(_CUBE), np.array(_FACES), process=False)

    def exported(kind: str) -> bytes:
        content = cube.export(file_type=kind)
        return content.encode() if isinstance(content, str) else bytes(content)

    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        sizes = "width#1=50\ndepth#1=50\nheight#1=90\nmodelRotation#1=1 0 0 0 1 0 0 0 1\n"
        text = f"id#1=a\nname#1=Chair\ncategory#1=Seats\nmodel#1=/a.obj\n{sizes}"
        # of a fixed date: by its name alone a member has the time of now
        archive.writestr(zipfile.ZipInfo(sweethome.CATALOGUE), text)
        archive.writestr(zipfile.ZipInfo("a.obj"), exported("obj"))
    glb = exported("glb")
    length = int.from_bytes(glb[12:16], "little")
    scene = json.loads(glb[20 : 20 + length])
    import base64

    data = base64.b64encode(glb[28 + length :]).decode()
    scene["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
    hull = {"vertices_m": _CUBE, "faces": _FACES}
    piece = {
        "format": store.FORMAT, "version": store.VERSION, "name": "cube", "category": "stool",
        "size_m": [0.5, 0.5, 0.5], "mass_kg": 8.0, "licence": "CC0", "credit": "",
        "sit": [{"point_m": [0, 0, 0.5], "facing_rad": 0.0, "rests_at": [1.0]}], "lie": None,
        "hulls": [hull],
    }  # fmt: skip
    found = {
        kind: Sample(f"a.{kind}", exported(kind), source.read, "text" if kind == "obj" else "bytes")
        for kind in ("obj", "stl", "ply", "glb")
    }
    return found | {
        "gltf": Sample("a.gltf", json.dumps(scene).encode(), source.read, "json"),
        "sh3f": Sample("a.sh3f", file.getvalue(), _library, "zip"),
        "piece": Sample("a.piece.json", json.dumps(piece).encode(), store.read, "json"),
    }


def _library(path: Path) -> None:
    for job in importing.jobs([path], ImportOptions()):
        if job.entry is not None and not job.refused:
            sweethome.source(job.entry)


def _others(folder: Path) -> dict[str, Sample]:
    take = recordings.Take(
        np.zeros((4, 43)), np.zeros((4, 34)), np.zeros((4, 28)), np.zeros((4, 3)),
        np.tile([1.0, 0, 0, 0], (4, 1)),
        recordings.rows_of([Box((0.0, 0.0, 0.2), (0.2, 0.2, 0.2), (1.0, 0.0, 0.0, 0.0))]),
        "chair", 1.0, {"ball_radius_m": 0.1},
    )  # fmt: skip
    recordings.write(folder / "a.msgpack", recordings.Recording([take], {"task": "sit"}))
    layout = checkpoints.Layout("sit", (("a", 4), ("b", 3)), (("g", 2),), 3, (8, 8))
    manifest = checkpoints.Manifest(layout, 3, 4096, {"experiment": "{}"})
    state = {"policy": {"a": torch.zeros(2), "b": {"c": 3}}}
    checkpoints.write(folder / "checkpoint", state, manifest)
    config = json.dumps({"task": "sit", "experiment": to_json(PRESETS["fast"])}).encode()
    metrics = b'{"iteration": 1, "samples": 64, "ppo/kl": null}\n' * 6
    return {
        "recording": Sample("a.msgpack", (folder / "a.msgpack").read_bytes(), _recorded, "msgpack"),
        "manifest": Sample(
            checkpoints.MANIFEST, (folder / "checkpoint" / checkpoints.MANIFEST).read_bytes(),
            lambda p: checkpoints.read(p.parent, ("policy",)), "signed",
            (("policy.safetensors", (folder / "checkpoint/policy.safetensors").read_bytes()),),
        ),
        "weights": Sample(
            "policy.safetensors", (folder / "checkpoint/policy.safetensors").read_bytes(),
            lambda p: checkpoints.read(p.parent, ("policy",)), "bytes",
            ((checkpoints.MANIFEST, (folder / "checkpoint" / checkpoints.MANIFEST).read_bytes()),),
        ),
        "config": Sample(
            "config.json", config, lambda p: read_experiment(RunDirectory(p.parent)), "json"
        ),
        "metrics": Sample("metrics.jsonl", metrics, read_metrics, "text"),
    }  # fmt: skip


def _recorded(path: Path) -> None:
    for take in recordings.read(path).takes:
        recordings.pose(model := recordings.model_of(take), _data(model), take, 0)


def _data(model: Any) -> Any:
    import mujoco

    return mujoco.MjData(model)
