"""Reader of poselib's `.npy` motions (IsaacGymEnvs, ASE and their successors).

Source: NVIDIA's poselib: a pickled dictionary with `rotation` [T, J, 4] (x, y, z, w), local or
global, `root_translation` [T, 3], `skeleton_tree` (node_names, parent_indices, local_translation),
`fps`; z up, metres. The pickle is read without executing code.
"""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from world.character import model as character
from world.errors import ClipError
from world.motions.formats import own, safe_pickle
from world.motions.formats.recording import Recording, forward
from world.motions.licences import licence
from world.refusals import reason

SUFFIXES = (".npy",)
KEYS = ("rotation", "root_translation", "skeleton_tree", "fps")
#: Greatest difference of offsets from the character's own skeleton, m.
_OURS_M = 0.02


def read(path: Path) -> Recording:
    """The motion in a poselib file. Raises ClipError."""
    content = safe_pickle.load_npy(path)
    missing = [key for key in KEYS if key not in safe_pickle.keys(content, path)]
    if missing:
        raise ClipError(f"{path}: no {', '.join(missing)}; a poselib motion has {', '.join(KEYS)}")
    try:
        tree = content["skeleton_tree"]
        names = tuple(str(name) for name in tree["node_names"])
        parents = tuple(int(p) for p in _array(tree["parent_indices"]))
        offset = _array(tree["local_translation"])
        rotation = _array(content["rotation"])
        root = _array(content["root_translation"])
        fps = safe_pickle.number(content["fps"])
        is_local = bool(content.get("is_local", True))
    except (ValueError, TypeError, KeyError) as error:
        raise ClipError(f"{path}: not a readable poselib motion ({reason(error)})") from error
    if rotation.shape != (len(root), len(names), 4) or offset.shape != (len(names), 3):
        raise ClipError(
            f"{path}: rotations are {list(rotation.shape)}; expected"
            f" [{len(root)}, {len(names)}, 4] for its {len(names)} joints"
        )
    if not (np.isfinite(rotation).all() and np.isfinite(root).all()):
        raise ClipError(f"{path}: holds non-finite values")
    if len(parents) != len(names) or any(p >= i for i, p in enumerate(parents)):
        raise ClipError(f"{path}: parent_indices do not name an earlier joint each")
    turn = Rotation.from_quat(rotation.reshape(-1, 4)).as_matrix()
    local = turn.reshape(len(root), len(names), 3, 3)
    if not is_local:
        above = local[:, [max(p, 0) for p in parents]]
        relative = np.swapaxes(above, -1, -2) @ local
        relative[:, [i for i, p in enumerate(parents) if p < 0]] = local[:, :1]
        local = relative
    if is_ours(names, offset):
        order = [names.index(body) for body in character.BODIES]
        quaternion = Rotation.from_matrix(local[:, order].reshape(-1, 3, 3))
        ours = quaternion.as_quat(scalar_first=True).reshape(-1, 15, 4)
        return own.recording(path, fps, root, ours)
    position, turned = forward(parents, offset, local, root)
    return Recording(
        name=path.stem,
        fps=fps,
        names=names,
        parents=parents,
        position=position,
        rotation=turned,
        source=path.name,
        licence=licence(path),
        unit_m=1.0,
        up="z",
    )


def is_ours(names: tuple[str, ...], offset: np.ndarray) -> bool:
    """Whether a skeleton is the character's own: our bodies, our bones, hanging arms."""
    if set(names) != set(character.BODIES):
        return False
    order = [names.index(body) for body in character.BODIES]
    return bool(np.abs(offset[order][1:] - own.offsets()[1:]).max() < _OURS_M)


def _array(field: Any) -> np.ndarray:
    """The array of a field that poselib stores as {'arr': ..., 'context': ...}."""
    return safe_pickle.numbers(field["arr"] if isinstance(field, dict) else field)
