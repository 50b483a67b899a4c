"""Reader of OMOMO's motions in the form processed for InterMimic: a torch tensor [T, 591], with the
tracked object.

Source: Xu et al. 2025 (InterMimic) and its published code: columns 0:3 root position, 3:7 its
quaternion, 9:162 joint angles, 162:318 positions of 52 SMPL-H joints, 318:321 and 321:325 position
and quaternion of the object, 331:383 contacts, 383:591 global quaternions of the joints; 30 Hz, z
up, metres, quaternions x, y, z, w. The pickle within is read without executing code.
"""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats import safe_pickle
from world.motions.formats.recording import RecordedBox, Recording
from world.motions.licences import licence
from world.refusals import reason

SUFFIXES = (".pt",)
COLUMNS = 591
RATE_HZ = 30.0
_FINGERS = tuple(
    f"{f}{i}" for f in ("Index", "Middle", "Pinky", "Ring", "Thumb") for i in (1, 2, 3)
)
_LEG, _ARM = ("Hip", "Knee", "Ankle", "Toe"), ("Thorax", "Shoulder", "Elbow", "Wrist", *_FINGERS)
NAMES = (
    "Pelvis",
    *(f"L_{part}" for part in _LEG),
    *(f"R_{part}" for part in _LEG),
    "Torso", "Spine", "Chest", "Neck", "Head",
    *(f"L_{part}" for part in _ARM),
    *(f"R_{part}" for part in _ARM),
)  # fmt: skip
_ABOVE = {"Hip": "Pelvis", "Torso": "Pelvis", "Spine": "Torso", "Chest": "Spine", "Neck": "Chest",
          "Head": "Neck", "Thorax": "Chest"}  # fmt: skip
#: Objects of OMOMO that are boxes, by name: edges, m; centre and axes in the frame of the tracked
#: mesh, whose axes are those of the scan. Measured on the mesh as its smallest box; along the
#: scan's axes, which are turned by 27 and tilted by 9 degrees, its extent is larger: 0.471, 0.459
#: and 0.408 m.
BOXES = {
    "largebox": (
        (0.335, 0.338, 0.360),
        (0.0010, -0.0016, 0.0064),
        ((0.8976, 0.4260, 0.1135), (0.4378, -0.8913, -0.1175), (0.0511, 0.1552, -0.9866)),
    )
}


def read(path: Path) -> Recording:
    """The motion and the tracked box in an OMOMO file. Raises ClipError."""
    rows = tensor(path).astype(np.float64)
    if rows.ndim != 2 or rows.shape[1] != COLUMNS:
        raise ClipError(
            f"{path}: a tensor {list(rows.shape)}; processed OMOMO motions are [T, {COLUMNS}]"
        )
    if not np.isfinite(rows).all():
        raise ClipError(f"{path}: holds non-finite values")
    quaternion = rows[:, 383:591].reshape(-1, 4)
    if (np.abs(np.linalg.norm(quaternion, axis=1) - 1) > 0.05).any():
        raise ClipError(f"{path}: columns 383 to 590 are no unit quaternions of its 52 joints")
    box = _box(path, rows)
    remarks = () if box else (f"no box: the size of {_object(path)} is not known",)
    return Recording(
        name=path.stem,
        fps=RATE_HZ,
        fps_assumed=True,
        names=NAMES,
        parents=parents(),
        position=rows[:, 162:318].reshape(-1, 52, 3),
        rotation=Rotation.from_quat(quaternion).as_matrix().reshape(-1, 52, 3, 3),
        source=path.name,
        licence=licence(path),
        unit_m=1.0,
        up="z",
        approximated=remarks,
        box=box,
    )


def parents() -> tuple[int, ...]:
    """Each joint's parent, −1 for the pelvis."""
    found: list[int] = []
    for index, name in enumerate(NAMES):
        side, _, part = name.rpartition("_")
        finger = part.rstrip("123")
        if index == 0:
            found.append(-1)
        elif part in _ABOVE:
            found.append(NAMES.index(_ABOVE[part]))
        elif f"{finger}1" in _FINGERS and part.endswith("1"):
            found.append(NAMES.index(f"{side}_Wrist"))
        else:
            found.append(index - 1)
    return tuple(found)


def _object(path: Path) -> str:
    """The object's name, from the file's: sub3_largebox_003."""
    parts = path.stem.split("_")
    return parts[1] if len(parts) > 1 else path.stem


def _box(path: Path, rows: np.ndarray) -> RecordedBox | None:
    """The tracked box; None for an object that is no box of known size."""
    known = BOXES.get(_object(path).lower())
    quaternion = rows[:, 321:325]
    if known is None or (np.abs(np.linalg.norm(quaternion, axis=1) - 1) > 0.05).any():
        return None
    size, centre, axes = known
    turn = Rotation.from_quat(quaternion)
    return RecordedBox(
        position=rows[:, 318:321] + turn.apply(centre),
        rotation=turn.as_matrix() @ _orthonormal(np.array(axes)),
        size_m=size,
    )


def _orthonormal(axes: np.ndarray) -> np.ndarray:
    u, _, v = np.linalg.svd(axes)
    return u @ v


def tensor(path: Path) -> np.ndarray:
    """The one float tensor of a torch file. Raises ClipError for any other content."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            (head,) = [name for name in names if name.endswith("data.pkl")]
            content = safe_pickle.loaded_tensor(_member(archive, head))
            stored = head.removesuffix("data.pkl") + f"data/{content.key}"
            raw = _member(archive, stored)
    except safe_pickle.RefusedError as error:
        raise ClipError(
            f"{path}: refused: it asks for {error}; one tensor of numbers is read"
        ) from error
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ClipError(f"{path}: not a readable torch tensor ({reason(error)})") from error
    if content.count * content.kind.itemsize > len(raw):
        raise ClipError(
            f"{path}: its tensor {list(content.shape)} needs {content.count} numbers; the file has"
            f" {len(raw) // content.kind.itemsize}"
        )
    return np.frombuffer(raw, content.kind, content.count).reshape(content.shape)


def _member(archive: zipfile.ZipFile, name: str) -> bytes:
    entry: Any = archive.getinfo(name)
    if entry.file_size > safe_pickle.MAX_ARRAY_BYTES:
        raise ValueError(f"{name} unpacks to {entry.file_size} bytes")
    with archive.open(entry) as file:
        return file.read(entry.file_size)
