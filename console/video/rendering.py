"""Rendering of recordings as mp4 and filmstrips, offscreen by MuJoCo, with a following camera."""

import importlib
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Recording, Take, model_of, pose
from world.character import model as character
from world.character.model import CONTROL_HZ
from world.errors import InhabitError

Image = NDArray[np.uint8]
#: Colour of a character that is followed.
GHOST_RGBA = (0.95, 0.75, 0.35, 0.35)

_PROBE = (
    "import mujoco; m = mujoco.MjModel.from_xml_string('<mujoco/>'); "
    "r = mujoco.Renderer(m, 16, 16); r.update_scene(mujoco.MjData(m)); r.render(); r.close()"
)


class VideoError(InhabitError):
    """A video that cannot be rendered or written."""


@dataclass(frozen=True)
class Look:
    """Size and camera of a video."""

    width: int = 640
    height: int = 480
    distance_m: float = 4.2
    """Distance from the camera to its look-at point, m."""
    elevation_deg: float = -18.0
    azimuth_deg: float = 125.0


def choose_gl() -> str | None:
    """Return a working value of MUJOCO_GL: the one set, else egl, else osmesa; None without any.

    Each is tried in a process of its own, because MuJoCo binds a backend once and a broken driver
    can end the process.
    """
    wanted = os.environ.get("MUJOCO_GL")
    for backend in (wanted,) if wanted else ("egl", "osmesa"):
        environment = os.environ | {"MUJOCO_GL": backend}
        try:
            done = subprocess.run(
                [sys.executable, "-c", _PROBE], env=environment, capture_output=True, timeout=60
            )
        except subprocess.TimeoutExpired:
            continue
        if done.returncode == 0:
            return backend
    return None


def require_gl() -> None:
    """Choose a backend for this process before a Renderer is created; VideoError without any."""
    backend = choose_gl()
    if backend is None:
        raise VideoError(
            "no backend can render offscreen (tried MUJOCO_GL=egl and osmesa): "
            "install one, for instance with apt-get install libosmesa6"
        )
    os.environ["MUJOCO_GL"] = backend
    # MuJoCo read the variable at its first import.
    importlib.reload(importlib.import_module("mujoco.rendering.classic.gl_context"))


def draw(
    take: Take,
    look: Look,
    frames: Sequence[int],
    follow: float,
    model: mujoco.MjModel | None = None,
) -> Iterator[Image]:
    """Yield images [height, width, 3] of the given control steps of one take.

    follow: fraction of the distance to the character that the camera moves per image (1: centred).
    model: of the take's scene, if available; its drawing settings are changed.
    """
    model = model_of(take) if model is None else model
    _dress(model, look)
    data = mujoco.MjData(model)
    ghost = _Ghost() if len(take.ghost) else None
    camera = mujoco.MjvCamera()
    camera.distance, camera.elevation = look.distance_m, look.elevation_deg
    camera.azimuth = look.azimuth_deg
    renderer = mujoco.Renderer(model, look.height, look.width)
    try:
        centre = None
        for frame in frames:
            pose(model, data, take, frame)
            mujoco.mj_camlight(model, data)
            root = np.array([data.qpos[0], data.qpos[1], 0.75])
            # a smoothed camera follows the walk, not each step
            centre = root if centre is None else centre + follow * (root - centre)
            camera.lookat[:] = centre
            renderer.update_scene(data, camera)
            if ghost is not None:
                ghost.add(renderer.scene, take.ghost[frame])
            yield renderer.render().copy()
    finally:
        renderer.close()


class _Ghost:
    """The character that is followed, drawn through whatever is there."""

    def __init__(self) -> None:
        self._model = character.spec().compile()
        self._data = mujoco.MjData(self._model)

    def add(self, scene: mujoco.MjvScene, qpos: NDArray[np.float64]) -> None:
        """Add it to a scene, in the pose qpos [43]."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        before = scene.ngeom
        mujoco.mjv_addGeoms(
            self._model,
            self._data,
            mujoco.MjvOption(),
            mujoco.MjvPerturb(),
            int(mujoco.mjtCatBit.mjCAT_DYNAMIC),
            scene,
        )
        for index in range(before, scene.ngeom):
            scene.geoms[index].rgba[:] = GHOST_RGBA


def _dress(model: mujoco.MjModel, look: Look) -> None:
    """Set light and a large enough image buffer; the physics of the model does not change."""
    model.vis.global_.offwidth = max(look.width, model.vis.global_.offwidth)
    model.vis.global_.offheight = max(look.height, model.vis.global_.offheight)
    model.vis.headlight.ambient[:] = 0.45
    model.vis.headlight.diffuse[:] = 0.5
    model.vis.headlight.specular[:] = 0.1


def write_video(
    recording: Recording,
    out: Path,
    look: Look = Look(),
    model: mujoco.MjModel | None = None,
) -> int:
    """Write all takes in turn as mp4 at the control rate; return the number of frames.

    model: of the takes' scene, if available.
    """
    require_gl()
    out.parent.mkdir(parents=True, exist_ok=True)
    rate = recording.meta.get("control_hz", CONTROL_HZ)
    temporary = out.with_name(f".{out.stem}.part{out.suffix or '.mp4'}")
    try:
        try:
            count = _encode(recording, temporary, rate, look, model)
        except _EncoderError:
            # On a machine under load the encoder once ended without an error: try once more.
            count = _encode(recording, temporary, rate, look, model)
        temporary.replace(out)
    except OSError as error:
        raise VideoError(f"cannot write {out}: {error}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return count


class _EncoderError(OSError):
    """An encoder process that ended before it had all images."""


def _encode(
    recording: Recording, out: Path, rate: int, look: Look, model: mujoco.MjModel | None
) -> int:
    """Draw and encode all takes; return the number of images."""
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(out),
        (look.width, look.height),
        fps=rate,
        codec="libx264",
        quality=7,
        macro_block_size=2,
        ffmpeg_log_level="error",
    )
    writer.send(None)
    count = 0
    for take in recording.takes:
        for image in draw(take, look, range(len(take)), 0.15, model):
            try:
                writer.send(np.ascontiguousarray(image))
            except OSError as error:
                raise _EncoderError(*error.args) from error
            count += 1
    writer.close()
    return count


def write_filmstrip(
    recording: Recording, out: Path, columns: int = 8, look: Look | None = None
) -> None:
    """Write a filmstrip as PNG: one row per take, of `columns` evenly spaced frames."""
    import imageio.v3 as imageio

    require_gl()
    look = look or Look(width=240, height=240)
    rows = []
    for take in recording.takes:
        moments = np.linspace(0, len(take) - 1, columns).round().astype(int).tolist()
        rows.append(np.concatenate(list(draw(take, look, moments, 1.0)), axis=1))
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        imageio.imwrite(out, np.concatenate(rows, axis=0))
    except (OSError, ValueError) as error:
        raise VideoError(f"cannot write {out}: {error}") from error
