"""`inhabit motions play`: clips in a browser, served on this machine or written as one file."""

import webbrowser
from collections.abc import Sequence
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from console.commands import MotionsPlay
from console.listening import address_of, family, is_loopback, joined, refused
from console.motions import reading
from console.motions.page import page
from console.terminal import counted
from world.errors import ClipError, ConfigError
from world.motions.clip import Clip
from world.partial_files import replacing


def play_command(command: MotionsPlay) -> int:
    """Write the page with --html, else serve it until Ctrl-C."""
    chosen = clips([str(path) for path in command.paths], command.only)
    text = page(chosen)
    if command.html is not None:
        write(command.html, text)
        print(f"{command.html}: {counted(len(chosen), 'clip')}, {len(text) / 1e6:.1f} MB")
        return 0
    with server(command.listen, text) as running:
        host, port = running.server_address[:2]
        address = f"http://{joined(host if isinstance(host, str) else host.decode(), port)}/"
        print(f"{counted(len(chosen), 'clip')} at {address} (Ctrl-C ends)", flush=True)
        if command.open:
            webbrowser.open(address)
        running.serve_forever()
    return 0


def clips(paths: Sequence[str], only: str | None) -> list[Clip]:
    """Return the clips of paths, or the package's own, with their objects; ClipError without
    any."""
    found = reading.clips(tuple(paths))
    chosen = [clip for clip in found if only is None or only.lower() in clip.name.lower()]
    if not chosen:
        names = ", ".join(clip.name for clip in found[:8])
        raise ClipError(f"no clip's name holds '{only}'; there are {names}, ... ({len(found)})")
    return chosen


def write(path: Path, text: str) -> None:
    """Write the page atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8")


def server(listen: str, text: str) -> ThreadingHTTPServer:
    """A server of one page at HOST:PORT; ConfigError where that cannot be listened on."""
    content = text.encode()

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            if self.path.split("?")[0] != "/":
                self.send_error(HTTPStatus.NOT_FOUND)
                return
            self.send_response(HTTPStatus.OK)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)

        def log_message(self, format: str, *args: object) -> None:
            """Requests are not logged."""

    host, port = address_of(listen)
    if not is_loopback(host):
        raise ConfigError(f"--listen {listen}: the page has no authentication; use 127.0.0.1")

    class Server(ThreadingHTTPServer):
        address_family = family(host)

    try:
        return Server((host, port), Page)
    except (OSError, ValueError, OverflowError) as error:
        raise refused(listen, error) from error
