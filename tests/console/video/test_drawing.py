"""What a picture of a control step shows."""

from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from console.recording.format import Take
from console.video import camera, rendering
from console.video.drawing import Artist, Look, display_model, draw
from tests.support.console.recordings import take
from world.character import model as character

pytestmark = pytest.mark.skipif(
    rendering.choose_gl() is None, reason="nothing draws offscreen here"
)


@pytest.fixture(autouse=True)
def gl() -> None:
    rendering.require_gl()


def test_both_looks_show_the_character_and_captions_cover_their_corner() -> None:
    one = take(2)
    size = {"width": 160, "height": 120, "captions": False}
    (body,), (shapes,) = (
        draw(one, Look(**size, shapes=shape), [0])  # pyright: ignore
        for shape in ("body", "shapes")
    )
    assert (body != shapes).any(axis=2).mean() > 0.01
    (captioned,) = draw(one, Look(160, 120), [0], task="sit")
    rows, columns = np.nonzero((captioned != body).any(axis=2))
    assert len(rows) and rows.min() > 90 and columns.min() < 10
    # the sky is light and the floor is not black: no part of a picture is unlit
    assert body[:20].mean() > 180 and body.min(axis=2).max() > 150 and (body.max(axis=2) > 20).all()


def with_ghost(steps: int) -> Take:
    """A take whose reference stands half a metre aside."""
    one = take(steps)
    ghost = np.tile(character.standing_qpos(), (steps, 1))
    ghost[:, 1] -= 0.5
    return replace(one, ghost=ghost)


def test_an_artist_goes_from_take_to_take_and_back() -> None:
    takes = [take(3), with_ghost(3)]
    look = Look(160, 120)
    with closing(Artist(takes, look)) as artist:
        first, second, again = artist.image(0, 1), artist.image(1, 1), artist.image(0, 1)
    np.testing.assert_array_equal(first, again)
    assert (first != second).any(axis=2).mean() > 0.005, "the reference is drawn"
    np.testing.assert_array_equal(second, next(iter(draw(takes[1], look, [1]))))


def test_a_given_path_moves_the_camera() -> None:
    one, look = take(3), Look(160, 120, captions=False)
    path = camera.plan(one, display_model(one, look, None))
    turned = replace(path, azimuth=path.azimuth + 90.0)
    images = []
    for given in (None, path, turned):
        with closing(Artist([one], look)) as artist:
            images.append(artist.image(0, 0, given))
    np.testing.assert_array_equal(images[0], images[1])
    assert (images[0] != images[2]).any(axis=2).mean() > 0.02
