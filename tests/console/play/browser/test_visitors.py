"""Visitors of the player in a real browser: every task and control, a phone, two at once, and a tab
that is closed."""

from functools import partial

import pytest

from tests.support.browser import CHROMIUM, browser
from tests.support.console.pages import ALL_TEXT, goes_on, restarts, seconds, serving, until

pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on PATH to open pages in"),
    pytest.mark.timeout(900),
]
TASKS = ("sit", "lie", "carry", "walk")


def test_every_task_and_control() -> None:
    with serving(["play", *TASKS]) as address, browser() as page:
        page.size(1600, 900)
        page.open(address)
        until(page, "/As a recording/")
        for task in TASKS[1:] + TASKS[:1]:
            restarts(page, partial(page.choose, "policy", task))
            goes_on(page)
            if task == "lie":
                page.choose("piece", "bed-test-002")
                page.choose("side", "1")
            page.type("scale", "0.9")
            page.type("start x, y (m)", "0.5", 1)
            page.type("heading (°)", "90")
            if task == "carry":
                page.type("box x, y (m)", "1.1")
            restarts(page, partial(page.press, "Start again"))
            page.type("x, y (m)", "2.1")
            page.type("facing (°)", "150")
            page.choose("body", "pelvis")
            page.type("impulse (N s)", "20")
            page.type("direction (°)", "45")
            page.press("Push")
            page.press("Throw a ball")
            page.choose("speed", "4")
            goes_on(page)
            page.choose("speed", "1")
            page.tick("follow the character")
            page.tick("collision shapes")
            page.press("Pause")
            until(page, "/Play/")
            page.press("Play")
            restarts(page, partial(page.press, "Start anywhere"))
            goes_on(page)
            assert page.errors == [], task
        page.type("scale", "9")
        goes_on(page)
        assert "Not possible" not in page.run(ALL_TEXT), "the field keeps to its bounds"


def test_a_phone() -> None:
    with serving(["play", "walk"]) as address, browser() as page:
        page.size(400, 800, mobile=True)
        page.open(address)
        until(page, "/Throw a ball/")
        goes_on(page)
        assert page.sideways() <= 0
        page.press("Push")
        page.press("Throw a ball")
        goes_on(page)
        outside = page.run(
            "[...document.querySelectorAll('button')].filter(b => b.offsetParent)"
            ".map(b => b.getBoundingClientRect()).filter(r => r.width && (r.left < 0 || r.right >"
            " window.innerWidth)).length"
        )
        assert outside == 0 and page.errors == []


def test_two_visitors_and_a_closed_tab() -> None:
    """Both see one scene; when one leaves the other goes on; without any the time stands still."""
    with serving(["play", "sit"]) as address, browser() as one, browser() as other:
        for page in (one, other):
            page.open(address)
            until(page, "/Throw a ball/")
        one.press("Pause")
        until(other, "/Play/")
        shown = seconds(other)
        one.wait(f"{ALL_TEXT}.includes('{shown[0]:.2f} s of')")
        other.press("Play")
        until(one, "/Pause/")
        goes_on(one)
        one.press("Push")
        one.open("about:blank")  # the page is gone in the middle
        goes_on(other)
        left = seconds(other)[1]
        other.open("about:blank")
        other.open(address)
        until(other, "/Throw a ball/")
        assert seconds(other)[1] >= left, "the same scene"
        goes_on(other)
        assert one.errors == other.errors == []
