"""A real headless Chromium, driven by its DevTools protocol over a websocket."""

import base64
import itertools
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.request import urlopen

from websockets.sync.client import connect

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
#: As slow as a page may be on a busy machine without a GPU, s.
PATIENCE_S = 120.0
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0",
    "--no-first-run",
    "--disable-background-networking",
    "--window-size=1000,640",
)


class Page:
    """One open page: what its console says is kept in `errors`."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._ids = socket, itertools.count(1)
        self.errors: list[str] = []
        for domain in ("Runtime", "Log", "Page", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """The result of a DevTools method."""
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=PATIENCE_S))
            if message.get("id") == number:
                assert "error" not in message, message["error"]
                return message["result"]
            self._notice(message)

    def _notice(self, message: dict[str, Any]) -> None:
        method, what = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(what["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and what["type"] in ("error", "assert"):
            self.errors.append(json.dumps(what["args"]))
        elif method == "Log.entryAdded" and what["entry"]["level"] == "error":
            self.errors.append(json.dumps(what["entry"]))

    def open(self, address: str) -> None:
        """Load an address."""
        self.call("Page.navigate", url=address)

    def run(self, script: str) -> Any:
        """The value of a JavaScript expression, awaited."""
        found = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, script: str) -> Any:
        """The value of an expression as soon as it is true; it may fail before that."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            if value := self.run(f"(() => {{ try {{ return {script} }} catch {{}} }})()"):
                return value
            time.sleep(0.1)
        raise AssertionError(f"never true: {script}; the page said {self.errors}")

    def size(self, width: int, height: int, mobile: bool = False, dark: bool = False) -> None:
        """Set the size of the window, px, and the colours that the visitor prefers."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=mobile,
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=mobile)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])

    def sideways(self) -> int:
        """Pixels by which the page is wider than its window."""
        return int(self.run("document.documentElement.scrollWidth - window.innerWidth"))

    def click(self, x: float, y: float) -> None:
        """Click a point of the window, px."""
        for kind in ("mouseMoved", "mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def choose(self, label: str, option: str) -> None:
        """Choose an option of the list with this label."""
        field = f"document.getElementById({_control(label)})"
        self.wait(f"{field} !== null")
        self.run(f"{field}.scrollIntoView(), {field}.click()")
        shown = "[...document.querySelectorAll('[role=option]')].filter(o => o.offsetParent)"
        wanted = f"{shown}.find(o => o.innerText.trim() === {json.dumps(option)})"
        self.wait(f"{wanted} !== undefined")
        self.run(f"{wanted}.click()")

    def tick(self, label: str) -> None:
        """Click the checkbox with this label."""
        field = f"document.getElementById({_control(label)})"
        self.wait(f"{field} !== null && !{field}.disabled")
        self.run(f"{field}.click()")

    def type(self, label: str, value: str, part: int = 0) -> None:
        """Type a number into the field with this label; part: of a vector."""
        words = json.dumps(label)
        field = (
            "((row) => { while (row && !row.querySelector('input:not([type=hidden])'))"
            " row = row.parentElement; return"
            f" row.querySelectorAll('input:not([type=hidden])')[{part}]; }})("
            f"[...document.querySelectorAll('label')].find(l => l.innerText.trim() === {words}))"
        )
        self.wait(f"{field} !== undefined")
        self.run(f"{field}.focus(), {field}.select()")
        self.call("Input.insertText", text=value)
        self.key("Enter", 13)

    def picture(self) -> bytes:
        """A screenshot, PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def download_to(self, folder: Path) -> None:
        """Keep what the page gives to be saved in a folder."""
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(folder))

    def press(self, label: str) -> None:
        """Click the button with this text."""
        words = json.dumps(label)
        self.wait(
            f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() === {words})"
            " !== undefined"
        )
        self.run(
            f"[...document.querySelectorAll('button')].find(b => b.innerText.trim() === {words})"
            ".click()"
        )

    def key(self, name: str, code: int) -> None:
        """Type one key that prints nothing."""
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code
            )


def _control(label: str) -> str:
    """JavaScript: the id of the control of a label."""
    words = json.dumps(label)
    return (
        f"[...document.querySelectorAll('label')].find(l => l.innerText.trim() === {words}).htmlFor"
    )


@contextmanager
def browser() -> Iterator[Page]:
    """A page of a fresh Chromium, which ends with the block."""
    assert CHROMIUM is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [CHROMIUM, *_FLAGS, f"--user-data-dir={profile}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            port = _port(Path(profile) / "DevToolsActivePort", process)
            with urlopen(f"http://127.0.0.1:{port}/json", timeout=PATIENCE_S) as answer:
                targets = json.load(answer)
            address = next(t["webSocketDebuggerUrl"] for t in targets if t["type"] == "page")
            with connect(address, max_size=None, open_timeout=PATIENCE_S) as socket:
                yield Page(socket)
        finally:
            process.terminate()
            process.wait(30)


def _port(file: Path, process: subprocess.Popen[bytes]) -> int:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until and process.poll() is None:
        if file.exists() and (found := re.match(r"(\d+)\n", file.read_text())):
            return int(found[1])
        time.sleep(0.05)
    raise AssertionError(f"Chromium did not start (exit code {process.poll()})")
