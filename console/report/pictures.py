"""Pictures of a report, rendered by MuJoCo as JPEG: pieces, and filmstrips of trials."""

import base64
import io
from dataclasses import replace

import imageio.v3 as imageio
import mujoco
import numpy as np

from console.evaluation.stepping import Track
from console.video import drawing, rendering, stage
from console.video.canvas import Canvas, Image
from console.video.drawing import STILL
from world.furniture.piece import Piece
from world.scene.model import compile_scene

_QUALITY = 82


def can_draw() -> bool:
    """Return True if offscreen rendering works; chooses its backend for this process."""
    try:
        rendering.require_gl()
    except rendering.VideoError:
        return False
    return True


def of_piece(piece: Piece, width: int = 200, height: int = 160) -> str:
    """Return a picture of the piece alone, from its front and side, as a data URI."""
    model = stage.stage(compile_scene(piece), piece.name)
    data = mujoco.MjData(model)
    data.qpos[2] = -50.0  # the character is out of the picture
    low, high = piece.bounds()
    centre = (low + high) / 2
    mujoco.mj_kinematics(model, data)
    stage.light_at(model, centre)
    mujoco.mj_camlight(model, data)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = centre
    camera.distance = 1.6 * float(np.linalg.norm(high - low))
    camera.azimuth, camera.elevation = 215.0, -22.0
    with Canvas(height, width, STILL.samples) as canvas:
        canvas.show(model)
        return data_uri(canvas.image(data, camera, stage.options()))


def filmstrip(track: Track, columns: int = 8, size: int = 200) -> str:
    """Return evenly spaced frames of a trial, side by side, as a data URI."""
    look = replace(STILL, width=size, height=size, captions=False)
    last = min(len(track.take), track.steps + 15) - 1
    moments = np.linspace(0, last, columns).round().astype(int).tolist()
    images = list(drawing.draw(track.take, look, moments, track.model))
    return data_uri(np.concatenate(images, axis=1))


def data_uri(image: Image) -> str:
    """Return an image [height, width, 3] as a `data:` URI of a JPEG."""
    stream = io.BytesIO()
    imageio.imwrite(stream, image, extension=".jpg", quality=_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()
