"""Pictures in the page: JPEGs of pieces."""

import base64
import io

import imageio.v3 as imageio
import numpy as np
import pytest

from console.evaluation.stepping import Track
from console.recording.format import model_of
from console.report import pictures
from tests.support.console.recordings import take
from world.furniture.catalogue import find


def test_a_picture_comes_back_from_its_uri() -> None:
    image = np.full((16, 24, 3), (200, 40, 40), np.uint8)
    uri = pictures.data_uri(image)
    kind, _, data = uri.partition(",")
    assert kind == "data:image/jpeg;base64"
    back = imageio.imread(io.BytesIO(base64.b64decode(data)))
    assert back.shape == image.shape and np.abs(back.astype(int) - image).max() < 12


def test_pieces_look_like_themselves_alone() -> None:
    if not pictures.can_draw():
        pytest.skip("nothing draws offscreen here")
    chair, again, bed = (
        pictures.of_piece(find(name), 80, 64)
        for name in ("chair-train-000", "chair-train-000", "bed-train-000")
    )
    assert chair == again
    one, other = (
        imageio.imread(io.BytesIO(base64.b64decode(uri.partition(",")[2]))).astype(int)
        for uri in (chair, bed)
    )
    assert one.shape == (64, 80, 3) and (np.abs(one - other).max(axis=2) > 30).mean() > 0.1


def test_a_filmstrip_has_its_columns_and_the_character_moves() -> None:
    if not pictures.can_draw():
        pytest.skip("nothing draws offscreen here")
    one = take(40)
    one.qpos[:, 0] = np.linspace(0.0, 0.6, 40)
    track = Track(one, np.zeros((40, 114), np.float32), np.ones(40, np.float32), model_of(one), 40)
    uri = pictures.filmstrip(track, columns=3, size=96)
    found = imageio.imread(io.BytesIO(base64.b64decode(uri.partition(",")[2]))).astype(int)
    assert found.shape == (96, 3 * 96, 3)
    assert (np.abs(found[:, :96] - found[:, -96:]).max(axis=2) > 30).mean() > 0.02
