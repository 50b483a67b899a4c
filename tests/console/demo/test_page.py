"""The demo's page in a real browser: the list, clicks in the scene, a phone, and the saved room."""

import time
from pathlib import Path

import pytest

from tests.support.browser import CHROMIUM, browser
from tests.support.console.pages import goes_on, serving, until

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on PATH to open pages in"),
    pytest.mark.timeout(900),
]


def test_a_visit(tmp_path: Path) -> None:
    with serving(["demo", "--seed", "2"]) as address, browser() as page:
        page.download_to(tmp_path)
        page.size(1600, 900)
        page.open(address)
        until(page, "/reached/")
        for policy, name in (("sit", "chair"), ("carry", "small box"), ("lie", "bed")):
            page.press(name)
            until(page, f"/{policy}: {name}/")
        page.press("the middle")
        until(page, "/walk: 0[.]0, 0[.]0 m/")
        # the floor before the camera, below everything
        page.click(640, 700)
        page.wait("!document.documentElement.innerText.includes('walk: 0.0, 0.0 m')")
        until(page, "/walk: -?[0-9]/")
        page.press("Push")
        page.press("Throw a ball")
        goes_on(page)
        page.press("As a page (HTML)")
        saved = tmp_path / "inhabit.html"
        for _ in range(300):
            if saved.exists() and saved.stat().st_size:
                break
            time.sleep(0.1)
        assert page.errors == []
        page.open(saved.as_uri())
        told = "document.querySelector('[data-part=status]').textContent"
        page.wait(f"parseFloat({told}) > 0.3")
        assert page.errors == []


def test_a_phone() -> None:
    with serving(["demo"]) as address, browser() as page:
        page.size(400, 800, mobile=True)
        page.open(address)
        until(page, "/reached/")
        page.press("sofa")
        until(page, "/lie: sofa/")
        goes_on(page)
        assert page.sideways() <= 0 and page.errors == []
