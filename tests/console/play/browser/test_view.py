"""The player's page, and the pages that it and the report write, in a real headless Chromium."""

import io
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from console.recording import format as recording
from tests.support import small_clips
from tests.support.browser import CHROMIUM, PATIENCE_S, Page, browser
from tests.support.console.pages import ALL_TEXT, seconds, serving, until

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on PATH to open pages in"),
    pytest.mark.timeout(900),
]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of the real command, playing the committed policy."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    with serving(["play", "pretrained/sit", "--motions", str(clips)]) as found:
        yield found


def scene(page: Page) -> NDArray[np.int64]:
    """The middle of the page, between the panels: rows, columns, RGB."""
    image = np.asarray(Image.open(io.BytesIO(page.picture())).convert("RGB")).astype(np.int64)
    return image[150:, 345:-345]


def changed(before: NDArray[np.int64], after: NDArray[np.int64]) -> int:
    """Pixels that differ visibly."""
    return int((np.abs(after - before).max(axis=2) > 30).sum())


def settle(page: Page) -> tuple[float, float]:
    """The moment that a paused page shows, once it no longer changes."""
    before = seconds(page)
    for _ in range(100):
        time.sleep(0.5)
        now = seconds(page)
        if now == before:
            return now
        before = now
    raise AssertionError(f"it goes on: {before}")


def test_the_character_moves_and_time_can_be_scrubbed(address: str, tmp_path: Path) -> None:
    with browser() as page:
        page.download_to(tmp_path)
        page.open(address)
        until(page, "/As a recording/")
        # the first moments are over: the character is on its way
        page.wait(f"parseFloat({ALL_TEXT}.match(/of ([0-9.]+) s/)[1]) > 0.5")
        first = scene(page)
        assert np.unique(first.reshape(-1, 3), axis=0).shape[0] > 50, "something is drawn"
        begun = seconds(page)[1]
        page.wait(f"parseFloat({ALL_TEXT}.match(/of ([0-9.]+) s/)[1]) > {begun + 1.5}")
        assert changed(first, scene(page)) > 300, "the character moves"

        page.press("Pause")
        until(page, "/Play/")
        shown, newest = settle(page)
        late = scene(page)
        page.run("document.querySelector('[role=slider]').focus()")
        for _ in range(30):
            page.key("ArrowLeft", 37)
        page.wait(f"parseFloat({ALL_TEXT}.match(/([0-9.]+) s of/)[1]) < {shown - 0.8}")
        back = settle(page)
        assert back == (pytest.approx(shown - 1.0, abs=0.1), newest), "the past is kept"
        assert changed(late, scene(page)) > 200, "an earlier moment is shown"

        clothed = scene(page)
        page.tick("collision shapes")
        while changed(clothed, scene(page)) < 300:  # the test's limit of time ends it
            time.sleep(0.5)

        page.press("Push")
        until(page, "/this frame is in the past/")
        page.press("Continue from here")
        page.wait(f"parseFloat({ALL_TEXT}.match(/([0-9.]+) s of/)[1]) > {back[0] + 0.3}")
        page.press("Push")
        page.press("Throw a ball")
        page.press("Pause")
        until(page, "/Play/")
        settle(page)

        before = scene(page)
        page.wait("[...document.querySelectorAll('input[type=checkbox]')].every(b => !b.disabled)")
        ghost = "[...document.querySelectorAll('label')].find(l => l.innerText.includes('ghost'))"
        page.run(f"document.getElementById({ghost}.htmlFor).click()")
        until(page, "/standard deviations away/")
        page.wait(f"{ALL_TEXT}.includes('standard deviations away')")
        for _ in range(100):
            if changed(before, scene(page)) > 200:
                break
            time.sleep(0.3)
        assert changed(before, scene(page)) > 200, "the ghost is there"

        for name in ("inhabit.html", "inhabit.msgpack"):
            page.press("As a page (HTML)" if "html" in name else "As a recording (.msgpack)")
            wait_for(tmp_path / name)
        (kept,) = recording.read(tmp_path / "inhabit.msgpack").takes
        assert len(kept) / 30 == pytest.approx(seconds(page)[1], abs=0.05)
        assert page.errors == []
        replays(page, tmp_path / "inhabit.html")


def wait_for(file: Path) -> None:
    """A download, whole."""
    end = time.monotonic() + PATIENCE_S
    while not (file.exists() and file.stat().st_size):
        assert time.monotonic() < end, f"no {file.name}: {list(file.parent.iterdir())}"
        time.sleep(0.1)


def replays(page: Page, file: Path) -> None:
    """Open a page with a replay: it draws, goes on, and has no errors."""
    page.open(f"{file.as_uri()}#t=0.2")
    told = "document.querySelector('[data-part=status]').textContent"
    assert page.wait(told).startswith("0.20 s")
    still = scene(page)
    assert np.unique(still.reshape(-1, 3), axis=0).shape[0] > 50
    page.press("play")
    page.wait(f"parseFloat({told}) > 0.8")
    assert changed(still, scene(page)) > 100
    assert page.errors == []
