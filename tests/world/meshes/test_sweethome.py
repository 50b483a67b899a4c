"""Sweet Home 3D libraries, and what is none."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.world.meshes import CATALOGUE, TRIANGLES, _bytes, library, mesh, y_up
from world.errors import PieceError
from world.furniture.catalogue import find
from world.meshes import sweethome
from world.meshes.upright import upright

CHAIR = find("chair-train-000")


def test_a_sweet_home_library(tmp_path: Path) -> None:
    path = tmp_path / "mine.sh3f"
    content = _bytes(mesh(y_up(TRIANGLES)).export(file_type="obj"))
    path.write_bytes(library({"models/chair.obj": content}, CATALOGUE))
    found = {e.title: e for e in sweethome.entries(path)}
    chair = found["Kitchen chair"]
    assert (chair.licence, chair.credit) == ("CC0", "Ada Lovelace")
    corners = upright(sweethome.source(chair), chair.frame)
    assert np.allclose(np.ptp(corners.reshape(-1, 3), axis=0), (0.50, 0.45, 0.90), atol=1e-6)
    # the same chair, stretched to its catalogued size
    stretch = np.array((0.50, 0.45, 0.90)) / CHAIR.size_m
    assert np.allclose(corners, TRIANGLES * stretch, atol=1e-4)
    assert "not in the library" in found["Bar stool"].refused
    assert "outside the library" in found["Wrong table"].refused
    assert found["Sofa"].refused


def test_a_path_outside_the_folder_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "evil.sh3f"
    path.write_bytes(library({"../../evil.obj": b"v 0 0 0"}, CATALOGUE))
    with pytest.raises(PieceError, match=r"a path outside the library: \.\./\.\./evil\.obj"):
        list(sweethome.entries(path))


def test_a_zip_bomb_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.sh3f"
    zeros = bytes(sweethome.MAX_ENTRY_BYTES + 1)
    path.write_bytes(library({"models/chair.obj": zeros}, CATALOGUE))
    (chair, *_) = sweethome.entries(path)
    assert "MB unpacked" in chair.refused
    assert chair.content == b""
    many = library({f"{i}.obj": b"" for i in range(sweethome.MAX_ENTRIES + 1)}, CATALOGUE)
    path.write_bytes(many)
    with pytest.raises(PieceError, match="at most 20000"):
        list(sweethome.entries(path))


def test_what_is_no_library_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.sh3f"
    for content, says in (
        (b"no zip", "not a .sh3f library"),
        (library({"a.obj": b""}), "no PluginFurnitureCatalog"),
        (library({}, "provider=x"), "names no furniture"),
    ):
        path.write_bytes(content)
        with pytest.raises(PieceError, match=says):
            list(sweethome.entries(path))
