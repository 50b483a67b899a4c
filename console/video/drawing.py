"""Images of recordings: what is drawn at a control step, in this process."""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.recording.format import Take, model_of, pose
from console.video import camera, caption, stage
from console.video.camera import Path
from console.video.canvas import Canvas, Image
from console.video.stage import Shapes


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


FILM, STILL = Look(), Look(samples=4)
"""Appearance of films and of single pictures."""


class Artist:
    """Draws control steps of takes; to be closed.

    model: of the takes' scene, if available. task: name in the captions.
    """

    def __init__(
        self,
        takes: Sequence[Take],
        look: Look,
        model: mujoco.MjModel | None = None,
        task: str = "",
    ) -> None:
        self._takes, self._look, self._model, self._task = takes, look, model, task
        self._canvas = Canvas(look.height, look.width, look.samples)
        self._options, self._view = stage.options(), mujoco.MjvCamera()
        self._prepared = -1

    def image(self, number: int, frame: int, path: Path | None = None) -> Image:
        """Return the image [height, width, 3] of a control step of a take, by its number.

        path: of the camera over the take; default: planned at its first image.
        """
        if number != self._prepared:
            self._prepare(number, path)
        take, look = self._takes[number], self._look
        pose(self._shown, self._data, take, frame)
        stage.light_at(self._shown, self._path.lookat[frame])
        mujoco.mj_camlight(self._shown, self._data)
        self._path.apply(self._view, frame)
        ghost = self._ghost
        add = None if ghost is None else lambda scene: ghost.add(scene, take.ghost[frame])
        image = self._canvas.image(self._data, self._view, self._options, add)
        return caption.drawn(
            image, caption.text_of(take, frame, self._task) if look.captions else ""
        )

    def close(self) -> None:
        """Free the canvas."""
        self._canvas.close()

    def _prepare(self, number: int, path: Path | None) -> None:
        take = self._takes[number]
        self._shown = display_model(take, self._look, self._model)
        self._data = mujoco.MjData(self._shown)
        self._ghost = _Ghost(self._look.shapes) if len(take.ghost) else None
        self._path = camera.plan(take, self._shown) if path is None else path
        self._canvas.show(self._shown)
        self._prepared = number


def display_model(take: Take, look: Look, model: mujoco.MjModel | None) -> mujoco.MjModel:
    """Return the display model of a take; model: of its scene, if available."""
    return stage.stage(model_of(take) if model is None else model, take.piece, look.shapes)


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
    with closing(Artist([take], look, model, task)) as artist:
        for frame in frames:
            yield artist.image(0, frame)


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
            scene.geoms[index].rgba[:] = stage.GHOST
