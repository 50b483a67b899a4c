"""Pictures in the page: pieces of furniture, and filmstrips of trials; JPEG, drawn by MuJoCo."""

import base64
import io

import imageio.v3 as imageio
import mujoco
import numpy as np

from console.evaluation.stepping import Track
from console.video import rendering
from console.video.rendering import Image, Look
from world.furniture.piece import Piece
from world.scene.model import compile_scene

_QUALITY = 82
#: What stands for the sky, which MuJoCo leaves black.
_SKY = (244, 245, 247)


def can_draw() -> bool:
    """Whether anything draws offscreen here; chooses it for this process."""
    try:
        rendering.require_gl()
    except rendering.VideoError:
        return False
    return True


def of_piece(piece: Piece, width: int = 200, height: int = 160) -> str:
    """The piece alone, from its front and side, as a data URI."""
    model = compile_scene(piece)
    model.vis.headlight.ambient[:] = 0.45
    data = mujoco.MjData(model)
    data.qpos[2] = -50.0
    mujoco.mj_kinematics(model, data)
    mujoco.mj_camlight(model, data)
    low, high = piece.bounds()
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (low + high) / 2
    camera.distance = 1.6 * float(np.linalg.norm(high - low))
    camera.azimuth, camera.elevation = 215.0, -22.0
    renderer = mujoco.Renderer(model, height, width)
    try:
        renderer.update_scene(data, camera)
        return data_uri(with_sky(renderer.render()))
    finally:
        renderer.close()


def filmstrip(track: Track, columns: int = 8, size: int = 200) -> str:
    """Moments evenly spaced over a trial, side by side, as a data URI."""
    look = Look(width=size, height=size, distance_m=3.4)
    last = min(len(track.take), track.steps + 15) - 1
    moments = np.linspace(0, last, columns).round().astype(int).tolist()
    drawn = rendering.draw(track.take, look, moments, 1.0, track.model)
    images = [with_sky(image) for image in drawn]
    return data_uri(np.concatenate(images, axis=1))


def with_sky(image: Image) -> Image:
    """The image with a light sky."""
    image = image.copy()
    image[(image == 0).all(axis=2)] = _SKY
    return image


def data_uri(image: Image) -> str:
    """An image [height, width, 3] as a `data:` URI of a JPEG."""
    stream = io.BytesIO()
    imageio.imwrite(stream, image, extension=".jpg", quality=_QUALITY)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()
