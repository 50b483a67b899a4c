"""The page of `inhabit objects show --html` in a real browser."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from console.app import main
from console.objects import page
from tests.support.browser import CHROMIUM, browser
from tests.support.world.meshes import built
from world.furniture.catalogue import find

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")


def red(picture: bytes) -> float:
    """Share of the pixels in the colour of a seat's arrow."""
    image = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
    return float((np.abs(image - (0xD6, 0x45, 0x2A)).sum(axis=2) < 30).mean())


def test_a_piece_is_found_shown_and_turned(tmp_path: Path) -> None:
    out = tmp_path / "page.html"
    assert main(["objects", "show", "test", "--limit", "14", "--html", str(out)]) == 0
    with browser() as page:
        page.open(out.as_uri())
        assert page.wait("document.querySelectorAll('#list li').length") == 14
        first = page.picture()
        assert red(first) > 0.0005
        # a table has no seat to draw; the field finds by class
        page.run(
            "(() => { const find = document.getElementById('find'); find.value = 'table';"
            " find.dispatchEvent(new Event('input')); })()"
        )
        page.run("document.querySelector('#list li button').click()")
        page.wait("document.getElementById('facts').innerText.includes('table')")
        assert red(page.picture()) == 0.0
        assert page.errors == []


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_the_page_holds_everything(tmp_path: Path) -> None:
    evil = replace(find("chair-train-000"), credit="</script><b>")
    path = tmp_path / "page.html"
    page.write(path, [evil, built().piece])
    text = path.read_text()
    assert text.count("</script>") == 1
    start = text.index("const PIECES = ") + len("const PIECES = ")
    pieces = json.loads(text[start : text.index(";\n", start)])
    assert [p["name"] for p in pieces] == ["chair-train-000", "mine"]
    assert len(pieces[0]["faces"]) == 6 * len(evil.boxes)
    assert "http" not in text
