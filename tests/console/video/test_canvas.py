"""The canvas: light and shadow, and pictures that do not depend on those before."""

import mujoco
import numpy as np
import pytest

from console.recording.format import model_of, pose
from console.video import canvas as canvases
from console.video import rendering, stage
from console.video.canvas import Canvas
from tests.support.console.recordings import take

pytestmark = pytest.mark.skipif(
    rendering.choose_gl() is None, reason="nothing draws offscreen here"
)


@pytest.fixture(autouse=True)
def gl() -> None:
    rendering.require_gl()


def view(x_m: float, distance_m: float = 4.0) -> mujoco.MjvCamera:
    found = mujoco.MjvCamera()
    found.lookat[:], found.distance, found.elevation = (x_m, 0.0, 0.0), distance_m, -30.0
    return found


def lit(model: mujoco.MjModel, data: mujoco.MjData, centre_m: list[float]) -> None:
    stage.light_at(model, np.array(centre_m))
    mujoco.mj_forward(model, data)


def test_the_floor_beyond_the_shadow_map_is_lit() -> None:
    """With the light 30 m aside the map covers nothing of what is seen."""
    shown = stage.stage(model_of(take(1)), "chair-1")
    data, options, images = mujoco.MjData(shown), stage.options(), []
    options.geomgroup[stage.OBJECTS] = 0
    with Canvas(96, 128) as canvas:
        canvas.show(shown)
        for aside_m in (0.0, 30.0):
            lit(shown, data, [20.0, aside_m, 0.0])
            images.append(canvas.image(data, view(20.0), options).astype(int))
    inside, outside = images
    assert inside[48:].mean() > 150  # the floor, in the light
    assert np.abs(inside - outside).max() <= 2


@pytest.mark.parametrize("samples", [0, 4])
def test_objects_cast_shadows_on_a_floor_that_casts_none(samples: int) -> None:
    one = take(1)
    shown = stage.stage(model_of(one), one.piece)
    data, options = mujoco.MjData(shown), stage.options()
    images = {}
    with Canvas(96, 128, samples) as canvas:
        canvas.show(shown)
        pose(shown, data, one, 0)
        lit(shown, data, [0.0, 0.0, 0.0])
        for name, casts in (("shadows", True), ("none", False)):
            shown.light_castshadow[:] = casts
            images[name] = canvas.image(data, view(0.0), options).astype(int)
        # nothing but the floor: it is nowhere darker where shadows are possible
        options.geomgroup[:] = 0
        options.geomgroup[stage.SHOWN] = 1
        data.qpos[2], data.qpos[0] = 500.0, 500.0
        mujoco.mj_forward(shown, data)
        bare = []
        for casts in (True, False):
            shown.light_castshadow[:] = casts
            bare.append(canvas.image(data, view(0.0), options).astype(int))
    darker = (images["none"] - images["shadows"]).sum(axis=2) > 60
    assert 0.01 < darker.mean() < 0.2
    assert (bare[1] - bare[0]).max() <= 2


def test_a_picture_does_not_depend_on_the_one_before_nor_on_the_model_before() -> None:
    """The infinite floor is the same below a camera that comes from far away."""
    one = take(1)
    other, shown = (stage.stage(model_of(one), one.piece, s) for s in ("shapes", "body"))
    data, options = mujoco.MjData(shown), stage.options()
    pose(shown, data, one, 0)
    lit(shown, data, [0.0, 0.0, 0.0])
    images = []
    with Canvas(240, 320) as canvas:
        canvas.show(shown)
        images += [canvas.image(data, view(0.3), options) for _ in range(2)]
        for x_m in (3.7, 41.3):
            canvas.image(data, view(x_m), options)
            images.append(canvas.image(data, view(0.3), options))
        canvas.show(other)
        canvas.image(data, view(0.3), options)
        canvas.show(shown)
        images.append(canvas.image(data, view(0.3), options))
    for image in images[1:]:
        np.testing.assert_array_equal(image, images[0])


def test_what_is_added_is_drawn_and_the_first_row_is_the_top() -> None:
    shown = stage.stage(model_of(take(1)), "chair-1")
    data, options = mujoco.MjData(shown), stage.options()
    options.geomgroup[:] = 0
    options.geomgroup[stage.SHOWN] = 1
    data.qpos[:2] = 500.0
    lit(shown, data, [0.0, 0.0, 0.0])

    def ball(scene: mujoco.MjvScene) -> None:
        scene.ngeom += 1
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom - 1],
            mujoco.mjtGeom.mjGEOM_SPHERE,
            np.full(3, 0.3),
            np.array([0.0, 0.0, 0.3]),
            np.eye(3).flatten(),
            np.array([1.0, 0.0, 0.0, 1.0], np.float32),
        )

    with Canvas(96, 128) as canvas:
        canvas.show(shown)
        plain, added = (canvas.image(data, view(0.0), options, add) for add in (None, ball))
    changed = (added.astype(int) - plain)[..., 1] < -60
    rows, columns = np.nonzero(changed)
    assert 40 < columns.mean() < 88 and changed.sum() > 50 and 20 < rows.mean() < 70
    # the sky is above the floor
    assert plain[:10, :, 2].mean() > plain[-10:, :, 2].mean()


def test_the_texels_of_both_details_are_smaller_than_a_wrist() -> None:
    for detail in (canvases.FILM, canvases.PICTURE):
        assert 2.0 * detail.shadow_m / detail.shadow_texels < 0.02
