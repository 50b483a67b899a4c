"""The real commands that serve a page, and what their pages say."""

import re
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from tests.support.browser import PATIENCE_S, Page
from tests.support.paths import ROOT

ALL_TEXT = "document.documentElement.innerText"


@contextmanager
def serving(words: Sequence[str]) -> Iterator[str]:
    """The address of the page of a command; it still runs at the end of the block, which ends
    it."""
    process = subprocess.Popen(
        [sys.executable, "-m", "console", *words, "--no-open"],
        cwd=ROOT, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    lines: list[str] = []
    assert process.stdout is not None
    stdout = process.stdout
    reader = threading.Thread(target=lambda: lines.append(stdout.readline()), daemon=True)
    reader.start()
    reader.join(PATIENCE_S)
    try:
        found = re.search(r"http://127\.0\.0\.1:\d+/", lines[0] if lines else "")
        assert found is not None, f"it said {lines}, exit code {process.poll()}"
        yield found[0]
        assert process.poll() is None, "it still serves"
    finally:
        process.terminate()
        process.wait(60)


def seconds(page: Page) -> tuple[float, float]:
    """The moment that is shown, and the newest one, s."""
    text = page.wait(f"{ALL_TEXT}.match(/[0-9.]+ s of [0-9.]+ s/)[0]")
    shown, newest = re.findall(r"[0-9.]+", text)[:2]
    return float(shown), float(newest)


def until(page: Page, told: str) -> str:
    """The text that matches a pattern, as soon as there is one."""
    return page.wait(f"({ALL_TEXT}.match({told}) || [''])[0]")


def goes_on(page: Page) -> None:
    """Wait until the time of the scene has moved on by half a second."""
    newest = seconds(page)[1]
    page.wait(f"parseFloat({ALL_TEXT}.match(/of ([0-9.]+) s/)[1]) > {newest + 0.5}")


def restarts(page: Page, action: Callable[[], object]) -> None:
    """Do something that begins another scene, and wait until its time has been shown: less than was
    shown before, however soon it passes that again."""
    newest = seconds(page)[1]
    page.run(
        "window.begunAgain = false; new MutationObserver((_, seen) => {"
        f"const shown = {ALL_TEXT}.match(/of ([0-9.]+) s/);"
        f"if (shown && parseFloat(shown[1]) < {newest}) {{"
        "window.begunAgain = true; seen.disconnect(); } })"
        ".observe(document.body, {subtree: true, childList: true, characterData: true})"
    )
    action()
    page.wait("window.begunAgain")
