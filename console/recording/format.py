"""Recordings (`.msgpack`): full simulator states of episodes at every control step."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from rpc import codec
from world.errors import InhabitError
from world.furniture.piece import SLOTS, Box, Piece
from world.partial_files import replacing
from world.placeholders import read_bounded
from world.refusals import reason, refusing, why
from world.scene.model import PROJECTILE_BODY, Ball, add_boxes, scene_spec

FORMAT = "inhabit-recording"
SUFFIX = ".msgpack"
VERSION = 1
MAX_BYTES = 1 << 31
MAX_FRAMES, MAX_BOXES, MAX_BALLS = 1_000_000, 4096, 64
"""Limits of one take."""
MAX_REACH_M = 1000.0
"""Largest coordinate of an object in a scene, m."""
ARRAYS = ("qpos", "qvel", "ctrl", "mocap_pos", "mocap_quat", "boxes")
#: Each coordinate at which a ball out of the scene is drawn, m.
AWAY_M = -32.0
#: Arrays that recordings of the first version lack.
MORE = ("balls", "cargo", "stand", "ghost")


class RecordingError(InhabitError):
    """A recording that cannot be read or written."""


@dataclass(frozen=True)
class Take:
    """One scene over T control steps, in the world frame (metres, quaternions w, x, y, z).

    `mocap_pos` [T, 3] and `mocap_quat` [T, 4] place the piece of furniture; `boxes` [k, 10] is its
    shape, scaled: centre (3), half edges (3) and rotation (4) of each box in the piece frame, so
    that a recording can be drawn without the catalogue.
    """

    qpos: NDArray[np.float64]
    qvel: NDArray[np.float64]
    ctrl: NDArray[np.float64]
    mocap_pos: NDArray[np.float64]
    mocap_quat: NDArray[np.float64]
    boxes: NDArray[np.float64]
    piece: str
    scale: float
    meta: dict[str, Any] = field(default_factory=dict)
    balls: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 3)))
    """[T, k, 3] m: projectiles, NaN while they are out of the scene; [0, 0, 3] or [T, 0, 3] without
    any."""
    cargo: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """[3] m: half edges of a box to carry, whose pose then follows the character's coordinates in
    qpos [T, 50]; [0] without one."""
    stand: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    """[3] m: centre of the top of the target stand; [0] without a box."""
    ghost: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 43)))
    """[T, 43]: coordinates of the character that is followed; [0, 43] where none is."""

    def __len__(self) -> int:
        return len(self.qpos)


def boxes_of(piece: Piece | None) -> NDArray[np.float64]:
    """Return the boxes of a piece as rows [k, 10]; no rows for an empty scene."""
    return rows_of(piece.boxes if piece is not None else ())


def rows_of(boxes: Sequence[Box]) -> NDArray[np.float64]:
    """Return boxes as rows [k, 10]."""
    rows = [[*box.centre_m, *box.half_m, *box.quat] for box in boxes]
    return np.array(rows, np.float64).reshape(-1, 10)


def model_of(take: Take) -> mujoco.MjModel:
    """Return the simulator's model of a take's scene."""
    rows = [[float(x) for x in row] for row in take.boxes]
    boxes = tuple(
        Box((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8], r[9])) for r in rows
    )
    # an imported piece has more boxes, one for each hull, than a piece made of boxes may have
    piece = Piece(take.piece or "piece", "", boxes[:SLOTS], (), 0.0) if boxes else None
    cargo = None
    if len(take.cargo):
        x, y, z = take.cargo.tolist()
        cargo = Piece("box", "box", (Box((0.0, 0.0, 0.0), (x, y, z)),), (), 1.0)
    ball = Ball(radius_m=float(take.meta.get("ball_radius_m", Ball().radius_m)))
    spec = scene_spec(piece, (ball,) * take.balls.shape[1], cargo)
    add_boxes(spec, boxes[SLOTS:], SLOTS)
    return spec.compile()


def pose(model: mujoco.MjModel, data: mujoco.MjData, take: Take, frame: int) -> None:
    """Set the state of a take's scene at a control step and compute the bodies' poses; coordinates
    NaN count as 0."""
    data.qpos[: take.qpos.shape[1]] = np.nan_to_num(take.qpos[frame])
    data.mocap_pos[0], data.mocap_quat[0] = take.mocap_pos[frame], take.mocap_quat[frame]
    if len(take.stand):
        data.mocap_pos[1] = take.stand
    for index, at in enumerate(take.balls[frame] if take.balls.shape[1] else ()):
        joint = model.body(f"{PROJECTILE_BODY}{index}").jntadr[0]
        address = int(model.jnt_qposadr[joint])
        data.qpos[address : address + 3] = np.where(np.isnan(at), AWAY_M, at)
    mujoco.mj_kinematics(model, data)


@dataclass(frozen=True)
class Recording:
    """Takes of one task, with their origin (`meta`: task, control_hz, checkpoint, reason)."""

    takes: list[Take]
    meta: dict[str, Any]


def write(path: Path, recording: Recording) -> None:
    """Write a recording atomically."""
    takes = [
        {name: getattr(take, name) for name in (*ARRAYS, *MORE, "piece", "scale", "meta")}
        for take in recording.takes
    ]
    packed = codec.pack(
        {"format": FORMAT, "version": VERSION, "meta": recording.meta, "takes": takes}
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            partial.write_bytes(packed)
    except OSError as error:
        raise RecordingError(f"cannot write {path}: {error.strerror}") from error


def read(path: Path) -> Recording:
    """Read a recording; RecordingError for any other or damaged file."""
    try:
        packed = read_bounded(path, MAX_BYTES)
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error
    try:
        value = codec.unpack(packed)
    except Exception as error:
        if path.suffix.lower() != SUFFIX:
            raise RecordingError(f"{path} is no recording ({SUFFIX})") from error
        raise RecordingError(f"{path} is damaged or not a recording ({why(error)})") from error
    with refusing(RecordingError, path, "recording"):
        return _recording(value, path)


def _recording(value: Any, path: Path) -> Recording:
    if not isinstance(value, dict) or value.get("format") != FORMAT:
        raise RecordingError(f"{path} is not a recording of this program")
    if value.get("version") != VERSION:
        raise RecordingError(f"{path} has version {value.get('version')}; this reads {VERSION}")
    try:
        takes = [
            Take(
                **{name: np.asarray(take[name], np.float64) for name in ARRAYS},
                piece=str(take["piece"]),
                scale=float(take["scale"]),
                meta=dict(take["meta"]),
                **{name: np.asarray(take[name], np.float64) for name in MORE if name in take},
            )
            for take in value["takes"]
        ]
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path} lacks part of a recording ({reason(error)})") from error
    for number, take in enumerate(takes):
        if fault := _fault(take):
            raise RecordingError(f"{path}: take {number}: {fault}")
    return Recording(takes, dict(value["meta"]))


def _fault(take: Take) -> str:
    """Return what is wrong with a take; empty for a valid one."""
    frames = len(take.qpos) if take.qpos.ndim else 0
    columns = {"qpos": None, "qvel": None, "ctrl": None, "mocap_pos": 3, "mocap_quat": 4}
    for name, width in columns.items():
        shape = getattr(take, name).shape
        if len(shape) != 2 or shape[0] != frames or (width and shape[1] != width):
            return f"{name} is {list(shape)}, not [{frames}, {width or 'k'}]"
    cargo, balls = take.cargo.shape, take.balls.shape
    width = 50 if cargo == (3,) else 43
    if frames > MAX_FRAMES or take.qpos.shape[1] != width:
        return f"qpos is {list(take.qpos.shape)}, not [0 to {MAX_FRAMES}, {width}]"
    if take.boxes.ndim != 2 or take.boxes.shape[1] != 10 or len(take.boxes) > MAX_BOXES:
        return f"boxes are {list(take.boxes.shape)}, not [0 to {MAX_BOXES}, 10]"
    if not (np.abs(take.boxes) < MAX_REACH_M).all() or not (take.boxes[:, 3:6] > 0).all():
        return "boxes with edges that are no lengths"
    if len(balls) != 3 or balls[2] != 3 or balls[1] > MAX_BALLS or balls[0] not in (0, frames):
        return f"balls are {list(balls)}, not [{frames}, 0 to {MAX_BALLS}, 3]"
    if take.ghost.shape != (0, 43) and take.ghost.shape != (frames, 43):
        return f"ghost is {list(take.ghost.shape)}, not [{frames}, 43]"
    for name in ("cargo", "stand"):
        value = getattr(take, name)
        if value.shape not in ((0,), (3,)) or not (np.abs(value) < MAX_REACH_M).all():
            return f"{name} is {list(value.shape)}, not three lengths"
    if take.stand.shape == (3,) and cargo != (3,):
        return "a stand without a box"
    if (take.cargo <= 0).any():
        return "cargo with edges that are no lengths"
    radius = take.meta.get("ball_radius_m", 0.1)
    if not isinstance(radius, int | float) or not 0 < radius < MAX_REACH_M:
        return "ball_radius_m is no length"
    return "" if np.isfinite(take.scale) else "a scale that is no number"
