"""A sheet shows pieces and their places."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from console import existing
from console.objects import sheet
from tests.support.world.meshes import TRIANGLES, built
from world.errors import PieceError
from world.furniture.catalogue import find


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_a_sheet_shows_pieces_and_their_places(tmp_path: Path) -> None:
    pieces = [find("chair-train-000"), find("bed-train-000"), built().piece]
    path = tmp_path / "sheet.png"
    sheet.write(path, pieces)
    image = np.asarray(Image.open(path).convert("RGB")).astype(int)
    assert image.shape == (sheet.CELL + sheet.CAPTION, 3 * sheet.CELL, 3)
    cells = np.split(image, 3, axis=1)

    def share(cell: np.ndarray, colour: tuple[int, int, int]) -> float:
        return float((np.abs(cell - colour).sum(axis=2) < 30).mean())

    assert all(share(cell, sheet._SEAT) > 0.003 for cell in cells)
    lying = [share(cell, sheet._LIE) > 0.002 for cell in cells]
    assert lying == [False, True, False]
    existing.require(path, "", existing.OF_SUFFIX[".png"])  # its own
    with pytest.raises(PieceError, match="cannot write"):
        sheet.write(path / "under-a-file.png", pieces[:1])


def test_faces_are_seen_from_outside() -> None:
    piece = find("chair-train-000")
    turn = sheet.view()
    assert np.allclose(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1.0)
    assert TRIANGLES.shape[1:] == (3, 3)
    assert sheet.caption(piece).startswith("chair-train-000\n")
