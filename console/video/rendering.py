"""Rendering of recordings as films, animated pictures and filmstrips, offscreen by MuJoCo."""

import importlib
import os
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from console import existing
from console.recording.format import Recording
from console.terminal import doing
from console.video import camera, processes
from console.video.canvas import Image
from console.video.drawing import FILM, STILL, Artist, Look, draw
from world import surroundings
from world.character.model import CONTROL_HZ
from world.errors import InhabitError
from world.partial_files import replacing

#: Endings of animated pictures, drawn at every second control step; their quality, of 100.
ANIMATED, _HALF, _WEBP_QUALITY = (".webp", ".gif"), 2, 60
#: Images for which another process is worth its start, a second; most processes, each of a fifth of
#: a gigabyte.
_IMAGES_A_PROCESS, _PROCESSES = 100, 8

_PROBE = (
    "import mujoco; m = mujoco.MjModel.from_xml_string('<mujoco/>'); "
    "r = mujoco.Renderer(m, 16, 16); r.update_scene(mujoco.MjData(m)); r.render(); r.close()"
)


class VideoError(InhabitError):
    """A video that cannot be rendered or written."""


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


@doing("starting the renderer")
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


def write_video(
    recording: Recording,
    out: Path,
    look: Look = FILM,
    model: mujoco.MjModel | None = None,
    progress: Callable[[int], None] = lambda done: None,
    threads: int = 1,
) -> int:
    """Write all takes in turn as a film at the control rate; return the number of frames.

    The ending of `out` gives the form: .mp4, or .webp and .gif at half the rate, without sound of
    course. A take ends two seconds after its success. model: of the takes' scene, if available.
    progress: called with the number of finished images. threads: most processes that draw.
    The film does not depend on it.
    """
    require_gl()
    out.parent.mkdir(parents=True, exist_ok=True)
    rate = recording.meta.get("control_hz", CONTROL_HZ)
    try:
        with replacing(out, out.suffix or ".mp4") as partial:
            if out.suffix.lower() in ANIMATED:
                return _animate(recording, partial, rate, look, model, progress, threads)
            try:
                return _encode(recording, partial, rate, look, model, progress, threads)
            except _EncoderError:
                # On a machine under load the encoder once ended without an error: try once more.
                return _encode(recording, partial, rate, look, model, progress, threads)
    except OSError as error:
        raise VideoError(f"cannot write {out}: {error}") from error


class _EncoderError(OSError):
    """An encoder process that ended before it had all images."""


def images(
    recording: Recording,
    look: Look,
    model: mujoco.MjModel | None = None,
    every: int = 1,
    threads: int = 1,
) -> Generator[Image]:
    """Yield every so many images of all takes in turn.

    threads: most processes that draw. A short film, whose processes would take longer to start than
    to draw, is drawn in this one. A script that gives more than 1 needs `if __name__ ==
    "__main__":`, since each process imports it.
    """
    task, takes = str(recording.meta.get("task", "")), recording.takes
    wanted = [
        (number, frame)
        for number, take in enumerate(takes)
        for frame in camera.frames_of(take)[::every]
    ]
    count = processes_for(len(wanted), threads)
    if count > 1:
        yield from processes.images(takes, wanted, look, model, task, count)
        return
    with closing(Artist(takes, look, model, task)) as artist:
        for number, frame in wanted:
            yield artist.image(number, frame)


def processes_for(images: int, threads: int) -> int:
    """Return the number of processes that draw so many images on so many cores."""
    return max(1, min(threads, images // _IMAGES_A_PROCESS, _PROCESSES))


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
    threads: int,
) -> int:
    """Write an animated picture at half the rate; return the number of images."""
    from PIL import Image as pictures

    found = []
    with closing(images(recording, look, model, _HALF, threads)) as drawn:
        for image in drawn:
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
    threads: int,
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
    with closing(images(recording, look, model, threads=threads)) as drawn:
        for image in drawn:
            try:
                writer.send(np.ascontiguousarray(image))
            except OSError as error:
                raise _EncoderError(*error.args) from error
            count += 1
            progress(count)
    writer.close()
    return count


def _picture_terms(recording: Recording, out: Path) -> dict[str, Any]:
    """Return the parameters that write who made a picture, and the licence of its recording."""
    from PIL import Image as pictures
    from PIL import PngImagePlugin

    licence, suffix = str(recording.meta.get("licence") or ""), out.suffix.lower()
    if suffix == ".gif":
        return {"comment": "\n".join(filter(None, (existing.MARK, licence))).encode()}
    if suffix == ".png":
        texts = PngImagePlugin.PngInfo()
        texts.add_itxt(existing.PNG_DESCRIPTION, existing.MARK)
        if licence:
            texts.add_itxt("Copyright", licence)
        return {"pnginfo": texts}
    exif = pictures.Exif()
    exif[existing.DESCRIPTION] = existing.MARK
    if licence:
        exif[existing.COPYRIGHT] = licence.encode()  # a text would lose letters beyond ASCII
    return {"exif": exif}


def _terms(recording: Recording) -> list[str]:
    """Return the encoder's parameters that write who made a film, and its recording's licence."""
    licence = recording.meta.get("licence")
    made = ["-metadata", f"comment={existing.MARK}"]
    return [*made, "-metadata", f"copyright={licence}"] if licence else made


def write_filmstrip(
    recording: Recording, out: Path, columns: int = 8, look: Look | None = None
) -> None:
    """Write a filmstrip as PNG, whole or not at all: one row per take, of `columns` evenly spaced
    frames."""
    from PIL import Image as pictures

    require_gl()
    look = look or replace(STILL, width=280, height=240)
    task = str(recording.meta.get("task", ""))
    rows = []
    for take in recording.takes:
        moments = np.linspace(0, len(camera.frames_of(take)) - 1, columns).round()
        rows.append(
            np.concatenate(list(draw(take, look, moments.astype(int).tolist(), None, task)), axis=1)
        )
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        strip = pictures.fromarray(np.concatenate(rows, axis=0))
        with replacing(out) as partial:
            strip.save(partial, "PNG", **_picture_terms(recording, out))
    except (OSError, ValueError) as error:
        raise VideoError(f"cannot write {out}: {error}") from error
