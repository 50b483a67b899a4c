"""Reader of BVH files (Biovision hierarchy), such as CMU's, ACCAD's and LAFAN1's.

pybvh parses the text; the unit and the upward axis, which BVH does not state, are inferred later.
The ROOT's OFFSET is not added to its position channels: some files repeat the first frame there.
"""

import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from world.errors import ClipError
from world.motions.formats.bvh_channels import rigid
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence

if TYPE_CHECKING:
    import pybvh

SUFFIXES = (".bvh",)
#: A first frame is a pose added by the converter where all joints leave it at more than this
#: multiple of their usual speed, and by this many radians on average.
_ADDED_POSE = 8.0
_ADDED_POSE_RAD = 0.15


def read(path: Path) -> Recording:
    """The motion in a BVH file. Raises ClipError."""
    try:
        text = path.read_text(errors="replace")
        plain = rigid(text)
        content = _parsed(path, plain)
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise ClipError(f"{path}: not a readable BVH file ({_brief(error)})") from error
    joints = [node for node in content.nodes if not node.is_end_site()]
    column = {id(node): index for index, node in enumerate(joints)}
    nodes = list(content.nodes)
    place = {id(node): index for index, node in enumerate(nodes)}
    parents = tuple(-1 if n.parent is None else place[id(n.parent)] for n in nodes)
    local = np.tile(np.eye(3), (content.frame_count, len(nodes), 1, 1))
    for node, order in zip(joints, content.euler_orders, strict=True):
        angles = content.joint_angles[:, column[id(node)]]
        local[:, place[id(node)]] = Rotation.from_euler(order.upper(), angles).as_matrix()
    offset = np.array([node.offset for node in nodes], dtype=np.float64)
    position, rotation = forward(parents, offset, local, content.root_pos)
    first = 1 if has_added_pose(local) else 0
    return Recording(
        name=path.stem,
        fps=1.0 / content.frame_time,
        names=tuple(_name(node) for node in nodes),
        parents=parents,
        position=position,
        rotation=rotation,
        source=path.name,
        licence=licence(path.parent),
        approximated=(
            *(("first frame left out: a pose put in front",) if first else ()),
            *(("bones keep their lengths: joints' position channels left out",) if plain else ()),
        ),
    ).part(first, content.frame_count)


def _parsed(path: Path, text: str | None) -> "pybvh.Bvh":
    """The file, or a text in its place, parsed by pybvh."""
    import pybvh

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        if text is not None:
            path = Path(folder) / path.name
            path.write_text(text)
        return pybvh.read_bvh_file(path, world_up="+y", warn_on_world_up_disagreement=False)


def has_added_pose(local: np.ndarray) -> bool:
    """Whether the first of local rotations [T, J, 3, 3] is a pose that the converter added."""
    if local.shape[0] < 4:
        return False
    turned = np.swapaxes(local[:-1], -1, -2) @ local[1:]
    trace = np.trace(turned, axis1=-2, axis2=-1)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1)).mean(axis=1)
    return bool(angle[0] > max(_ADDED_POSE * np.median(angle[1:]), _ADDED_POSE_RAD))


def _name(node: object) -> str:
    """A joint's name, or its parent's with _end for an end site."""
    parent = getattr(node, "parent", None)
    return f"{parent.name}_end" if node.is_end_site() and parent else node.name  # pyright: ignore


def _brief(error: Exception) -> str:
    text = str(error).splitlines()[0] if str(error) else type(error).__name__
    return text[:160]
