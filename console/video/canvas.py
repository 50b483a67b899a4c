"""An offscreen OpenGL context in which display models are drawn, one after another."""

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from console.video.stage import EXTENT_M, FLOOR

Image = NDArray[np.uint8]

#: Most geoms of a scene.
_MOST_GEOMS = 10_000


@dataclass(frozen=True)
class Detail:
    """What the time of an image goes to."""

    shadow_texels: int
    """Width of the shadow map."""
    shadow_m: float
    """Half of the width that it covers, m: what lies outside casts no shadow, and must be nearly
    lost in the fog."""
    faces: tuple[int, int]
    """Slices and stacks of rounded shapes."""


FILM, PICTURE = Detail(832, 6.0, (10, 6)), Detail(1280, 7.0, (20, 14))
"""Of films, and of single pictures."""


class Canvas:
    """An offscreen context; to be closed.

    height, width: pixels. samples: of each pixel; 0 takes one, in less time. A canvas outlives
    the models that it draws, because the driver compiles its shaders anew for each context: a
    fifth of a second without a GPU.
    """

    def __init__(self, height: int, width: int, samples: int = 0) -> None:
        from mujoco.rendering.classic import gl_context  # after MUJOCO_GL was chosen

        assert gl_context.GLContext is not None, "rendering.require_gl comes first"
        self._samples, self._rect = samples, mujoco.MjrRect(0, 0, width, height)
        self._context: mujoco.MjrContext | None = None
        self._gl = gl_context.GLContext(width, height)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self.close()

    def show(self, model: mujoco.MjModel) -> None:
        """Take a display model, whose settings of quality are changed, in place of the last one."""
        detail, visual = PICTURE if self._samples else FILM, model.vis
        visual.quality.offsamples = self._samples
        visual.quality.numslices, visual.quality.numstacks = detail.faces
        visual.quality.shadowsize = detail.shadow_texels
        visual.map.shadowclip = detail.shadow_m / EXTENT_M
        visual.global_.offwidth = max(self._rect.width, visual.global_.offwidth)
        visual.global_.offheight = max(self._rect.height, visual.global_.offheight)
        self._gl.make_current()
        self._release()
        self._model, self._floor = model, int(model.geom(FLOOR).id)
        self._scene = mujoco.MjvScene(model, _MOST_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        _filter_textures(self._context)

    def image(
        self,
        data: mujoco.MjData,
        view: mujoco.MjvCamera,
        options: mujoco.MjvOption,
        add: Callable[[mujoco.MjvScene], None] | None = None,
    ) -> Image:
        """Return an image [height, width, 3] of a state of the model shown.

        add: adds geoms to the scene.
        """
        assert self._context is not None, "no model is shown"
        scene = self._scene
        # An infinite floor is centred below the camera of the scene, which MuJoCo updates last: a
        # picture would depend on the one before.
        mujoco.mjv_updateCamera(self._model, data, view, scene)
        mujoco.mjv_updateScene(
            self._model, data, options, None, view, mujoco.mjtCatBit.mjCAT_ALL.value, scene
        )
        self._keep_floor_out_of_shadows()
        if add is not None:
            add(scene)
        self._gl.make_current()
        mujoco.mjr_render(self._rect, scene, self._context)
        upside_down = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        mujoco.mjr_readPixels(upside_down, None, self._rect, self._context)
        return np.ascontiguousarray(upside_down[::-1])

    def close(self) -> None:
        """Free the context."""
        self._release()
        self._gl.free()

    def _keep_floor_out_of_shadows(self) -> None:
        """Keep the floor, beneath which nothing is, out of the shadow map: a fifth of the time of
        an image, and specks where the floor is farther from the light than its own texels say.

        MuJoCo draws shadows on decoration, but none of it.
        """
        for geom in self._scene.geoms[: self._scene.ngeom]:
            if geom.objid == self._floor and geom.objtype == mujoco.mjtObj.mjOBJ_GEOM:
                geom.category = int(mujoco.mjtCatBit.mjCAT_DECOR)
                return

    def _release(self) -> None:
        if self._context is not None:
            self._context.free()
            self._context = None


def _filter_textures(context: mujoco.MjrContext) -> None:
    """Set how the textures of a new context, which is the current one, are read."""
    from OpenGL import GL  # after MuJoCo has chosen its platform

    # What lies outside the shadow map is lit: MuJoCo repeats the texels at the map's edge.
    GL.glBindTexture(GL.GL_TEXTURE_2D, context.shadowTex)
    for axis in (GL.GL_TEXTURE_WRAP_S, GL.GL_TEXTURE_WRAP_T):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, axis, GL.GL_CLAMP_TO_BORDER)
    # its depths are reversed: 0 is the farthest
    GL.glTexParameterfv(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_BORDER_COLOR, [0.0, 0.0, 0.0, 0.0])
    # One mipmap of the grid instead of a blend of two: a twentieth of the time of an image.
    for number in range(context.ntexture):
        if context.textureType[number] == mujoco.mjtTexture.mjTEXTURE_2D:
            GL.glBindTexture(GL.GL_TEXTURE_2D, int(context.texture[number]))
            GL.glTexParameteri(
                GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR_MIPMAP_NEAREST
            )
    GL.glBindTexture(GL.GL_TEXTURE_2D, 0)
