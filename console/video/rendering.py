"""Rendering of recordings as films, animated pictures and filmstrips, offscreen by MuJoCo."""

import importlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Recording, Take, model_of, pose
from console.video import camera, caption, stage
from console.video.stage import Shapes
from world import surroundings
from world.character.model import CONTROL_HZ
from world.errors import InhabitError
from world.partial_files import replacing

Image = NDArray[np.uint8]
#: Endings of animated pictures, drawn at every second control step; their quality, of 100.
_COPYRIGHT = 0x8298  # tag of EXIF
ANIMATED, _HALF, _WEBP_QUALITY = (".webp", ".gif"), 2, 60
#: Colour of a reference.
GHOST_RGBA = (0.95, 0.75, 0.35, 0.35)

_PROBE = (
    "import mujoco; m = mujoco.MjModel.from_xml_string('<mujoco/>'); "
    "r = mujoco.Renderer(m, 16, 16); r.update_scene(mujoco.MjData(m)); r.render(); r.close()"
)


class VideoError(InhabitError):
    """A video that cannot be rendered or written."""


@dataclass(frozen=True)
class Look:
    """Size and appearance of a film or picture."""

    width: int = 640
    height: int = 480
    shapes: Shapes = "body"
    """body: a rounded character; shapes: its collision shapes."""
    captions: bool = True
    """Write task, piece, time and stage on each image."""
    samples: int = 0
    """Samples of a pixel, against jagged edges; each doubles the time of an image."""


STILL = Look(samples=4)
"""Appearance of single pictures."""


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


def gl_problem() -> str:
    """Return what is missing where `choose_gl` finds no backend."""
    wanted = os.environ.get("MUJOCO_GL")
    if wanted:
        return f"MUJOCO_GL={wanted} cannot render offscreen; unset it to try egl and osmesa"
    given = surroundings.missing_gl
    return f"{'' if given is None else f'{given}; '}neither egl nor osmesa can render offscreen"


def require_gl() -> None:
    """Choose a backend for this process before a Renderer is created; VideoError without any."""
    backend = choose_gl()
    if backend is None:
        raise VideoError(
            f"{gl_problem()}: install a backend, for instance with apt-get install libosmesa6"
        )
    os.environ["MUJOCO_GL"] = backend
    # MuJoCo read the variable at its first import.
    importlib.reload(importlib.import_module("mujoco.rendering.classic.gl_context"))


def draw(
    take: Take,
    look: Look,
    frames: Sequence[int],
    model: mujoco.MjModel | None = None,
    task: str = "",
) -> Iterator[Image]:
    """Yield images [height, width, 3] of the given control steps of one take.

    model: of the take's scene, if available. task: name in the captions.
    """
    shown = stage.stage(model_of(take) if model is None else model, take.piece, look.shapes)
    data = mujoco.MjData(shown)
    ghost = _Ghost(look.shapes) if len(take.ghost) else None
    path = camera.plan(take, shown)
    view, options = mujoco.MjvCamera(), stage.options()
    renderer = stage.renderer(shown, look.height, look.width, look.samples)
    try:
        for frame in frames:
            pose(shown, data, take, frame)
            stage.light_at(shown, path.lookat[frame])
            mujoco.mj_camlight(shown, data)
            path.apply(view, frame)
            renderer.update_scene(data, view, options)
            if ghost is not None:
                ghost.add(renderer.scene, take.ghost[frame])
            image = renderer.render()
            yield caption.drawn(image, caption.text_of(take, frame, task) if look.captions else "")
    finally:
        renderer.close()


class _Ghost:
    """The reference character, translucent."""

    def __init__(self, shapes: Shapes) -> None:
        self._model = stage.character_alone(shapes)
        self._data = mujoco.MjData(self._model)
        self._options = stage.options()

    def add(self, scene: mujoco.MjvScene, qpos: NDArray[np.float64]) -> None:
        """Add it to a scene, in the pose qpos [43]."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        before = scene.ngeom
        mujoco.mjv_addGeoms(
            self._model,
            self._data,
            self._options,
            mujoco.MjvPerturb(),
            int(mujoco.mjtCatBit.mjCAT_DYNAMIC),
            scene,
        )
        for index in range(before, scene.ngeom):
            scene.geoms[index].rgba[:] = GHOST_RGBA


def write_video(
    recording: Recording,
    out: Path,
    look: Look = Look(),
    model: mujoco.MjModel | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> int:
    """Write all takes in turn as a film at the control rate; return the number of frames.

    The ending of `out` gives the form: .mp4, or .webp and .gif at half the rate, without sound of
    course. A take ends two seconds after its success. model: of the takes' scene, if available.
    progress: called with the number of finished images.
    """
    require_gl()
    out.parent.mkdir(parents=True, exist_ok=True)
    rate = recording.meta.get("control_hz", CONTROL_HZ)
    try:
        with replacing(out, out.suffix or ".mp4") as partial:
            if out.suffix.lower() in ANIMATED:
                return _animate(recording, partial, rate, look, model, progress)
            try:
                return _encode(recording, partial, rate, look, model, progress)
            except _EncoderError:
                # On a machine under load the encoder once ended without an error: try once more.
                return _encode(recording, partial, rate, look, model, progress)
    except OSError as error:
        raise VideoError(f"cannot write {out}: {error}") from error


class _EncoderError(OSError):
    """An encoder process that ended before it had all images."""


def images(
    recording: Recording, look: Look, model: mujoco.MjModel | None = None, every: int = 1
) -> Iterator[Image]:
    """Yield every so many images of all takes in turn."""
    task = str(recording.meta.get("task", ""))
    for take in recording.takes:
        yield from draw(take, look, camera.frames_of(take)[::every], model, task)


def image_count(recording: Recording) -> int:
    """Return the number of images of a film."""
    return sum(len(camera.frames_of(take)) for take in recording.takes)


def _animate(
    recording: Recording,
    out: Path,
    rate: int,
    look: Look,
    model: mujoco.MjModel | None,
    progress: Callable[[int], None],
) -> int:
    """Write an animated picture at half the rate; return the number of images."""
    from PIL import Image as pictures

    found = []
    for image in images(recording, look, model, _HALF):
        found.append(pictures.fromarray(image))
        progress(_HALF * len(found))
    found[0].save(
        out,
        format=out.suffix[1:].upper(),
        save_all=True,
        append_images=found[1:],
        duration=round(1000 * _HALF / rate),
        loop=0,
        quality=_WEBP_QUALITY,
        method=4,
        **_picture_terms(recording, out),
    )
    return len(found)


def _encode(
    recording: Recording,
    out: Path,
    rate: int,
    look: Look,
    model: mujoco.MjModel | None,
    progress: Callable[[int], None],
) -> int:
    """Draw and encode all takes; return the number of images."""
    import imageio_ffmpeg

    writer = imageio_ffmpeg.write_frames(
        str(out),
        (look.width, look.height),
        fps=rate,
        codec="libx264",
        quality=None,  # pyright: ignore[reportArgumentType]  # the rate factor below
        macro_block_size=2,
        ffmpeg_log_level="error",
        # half the processor time of the encoder's default preset; 42 dB
        output_params=["-preset", "veryfast", "-crf", "18", *_terms(recording)],
    )
    writer.send(None)
    count = 0
    for image in images(recording, look, model):
        try:
            writer.send(np.ascontiguousarray(image))
        except OSError as error:
            raise _EncoderError(*error.args) from error
        count += 1
        progress(count)
    writer.close()
    return count


def _picture_terms(recording: Recording, out: Path) -> dict[str, Any]:
    """Return the parameters that write the licence of a recording into an animated picture."""
    from PIL import Image as pictures

    licence = recording.meta.get("licence")
    if not licence:
        return {}
    if out.suffix.lower() == ".gif":
        return {"comment": str(licence).encode()}
    exif = pictures.Exif()
    exif[_COPYRIGHT] = str(licence)
    return {"exif": exif}


def _terms(recording: Recording) -> list[str]:
    """Return the encoder's parameters that write the licence of a recording into its video."""
    licence = recording.meta.get("licence")
    return ["-metadata", f"copyright={licence}"] if licence else []


def write_filmstrip(
    recording: Recording, out: Path, columns: int = 8, look: Look | None = None
) -> None:
    """Write a filmstrip as PNG: one row per take, of `columns` evenly spaced frames."""
    import imageio.v3 as imageio

    require_gl()
    look = look or replace(STILL, width=280, height=240)
    task = str(recording.meta.get("task", ""))
    rows = []
    for take in recording.takes:
        moments = np.linspace(0, len(camera.frames_of(take)) - 1, columns).round()
        rows.append(
            np.concatenate(list(draw(take, look, moments.astype(int).tolist(), None, task)), axis=1)
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    try:
        imageio.imwrite(out, np.concatenate(rows, axis=0))
    except (OSError, ValueError) as error:
        raise VideoError(f"cannot write {out}: {error}") from error
