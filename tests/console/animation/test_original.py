"""Original meshes of imported pieces: found beside the piece, in its frame, or left alone."""

from pathlib import Path

import numpy as np
import pytest

from console.animation import original
from console.app import main
from console.kinds.furniture import piece_of
from tests.support.world.meshes import TRIANGLES, written
from world.furniture.catalogue import find
from world.meshes import store


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_a_mesh_is_shown_as_it_is_and_scaled(tmp_path: Path) -> None:
    mesh = written(tmp_path, ".obj")
    piece = piece_of(str(mesh)).scaled(1.1)
    found = original.of_object(str(mesh), piece, 1.1)
    assert found is not None and len(found.faces) == len(TRIANGLES)
    low, high = piece.bounds()
    np.testing.assert_allclose(found.vertices.min(axis=0), low, atol=0.05)
    np.testing.assert_allclose(found.vertices.max(axis=0), high, atol=0.05)
    extent = 1.1 * np.ptp(TRIANGLES.reshape(-1, 3), axis=0)
    np.testing.assert_allclose(np.ptp(found.vertices, axis=0), extent, atol=1e-6)


def test_an_imported_piece_finds_its_mesh_beside_it(tmp_path: Path) -> None:
    mesh = written(tmp_path, ".obj")
    assert main(["objects", "import", str(mesh), "--out", str(tmp_path)]) == 0
    file = tmp_path / f"chair{store.SUFFIX}"
    piece = store.read(file)
    assert original.of_object(str(file), piece, 1.0) is not None
    # a changed mesh is another piece's
    mesh.write_text(mesh.read_text() + "\n# changed\n")
    assert original.of_object(str(file), piece, 1.0) is None
    mesh.unlink()
    assert original.of_object(str(file), piece, 1.0) is None


def test_a_mesh_that_was_imported_by_other_axes_is_left_alone(tmp_path: Path) -> None:
    """The piece does not state its axes; its hulls show that the back is elsewhere."""
    mesh = written(tmp_path, ".obj")
    words = ["objects", "import", str(mesh), "--front", "-x", "--out", str(tmp_path), "--force"]
    assert main(words) == 0
    file = tmp_path / f"chair{store.SUFFIX}"
    assert original.of_object(str(file), store.read(file), 1.0) is None


def test_other_objects_have_none(tmp_path: Path) -> None:
    assert original.of_object(None, None, 1.0) is None
    assert original.of_object("chair-test-000", find("chair-test-000"), 1.0) is None
    assert original.of_object(str(tmp_path / "no.obj"), find("chair-test-000"), 1.0) is None
