"""A TCP proxy on loopback whose network can be cut, and that can act when bytes pass."""

import contextlib
import select
import socket
import struct
import threading
from collections.abc import Callable
from typing import Literal

Way = Literal["there", "back"]


class Proxy:
    """Forwards connections to `target`; bytes may vanish, connections may be reset.

    While `silent`, everything that arrives is swallowed, on connections old and new, and nobody is
    told; a connection that has lost bytes so never passes any again. While `refusing`, connections
    are reset.
    """

    def __init__(self, target: str) -> None:
        self._target = target
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.silent = self.refusing = False
        #: Called when so many bytes have passed one way since it was set, once: (way, bytes, what).
        self.when: tuple[Way, int, Callable[[], None]] | None = None
        self._passed = {"there": 0, "back": 0}
        self._open: list[socket.socket] = []
        self._lock = threading.Lock()
        self._closing = threading.Event()
        threading.Thread(target=self._accept, daemon=True).start()

    def after(self, way: Way, size: int, act: Callable[[], None]) -> None:
        """Do something when `size` more bytes have arrived on a way; the last, and what comes
        after on that connection, is not passed on."""
        self._passed[way] = 0
        self.when = (way, size, act)

    def cut(self, silent: bool) -> None:
        """Cut the network: packets vanish (silent), or everything is reset."""
        self.silent, self.refusing = silent, not silent
        if not silent:
            self._reset_all()

    def mend(self) -> None:
        """Let new connections through again."""
        self.silent = self.refusing = False

    def close(self) -> None:
        """End it and its connections."""
        self._closing.set()
        self._listener.close()
        self._reset_all()

    def _accept(self) -> None:
        while not self._closing.is_set():
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            if self.refusing:
                _reset(client)
            else:
                threading.Thread(target=self._carry, args=(client,), daemon=True).start()

    def _carry(self, client: socket.socket) -> None:
        host, _, port = self._target.rpartition(":")
        try:
            server = socket.create_connection((host, int(port)))
        except OSError:
            _reset(client)
            return
        with self._lock:
            self._open += [client, server]
        ways: dict[socket.socket, tuple[socket.socket, Way]] = {
            client: (server, "there"),
            server: (client, "back"),
        }
        dead = False
        while not self._closing.is_set():
            try:
                for source in select.select([client, server], [], [], 0.1)[0]:
                    data = source.recv(65536)
                    if not data:
                        raise ConnectionError
                    other, way = ways[source]
                    dead = self.silent or dead or self._acts(way, len(data))
                    if not dead:
                        other.sendall(data)
            except (OSError, ValueError):
                _reset(client)
                _reset(server)
                return

    def _acts(self, way: Way, size: int) -> bool:
        """Count what passes; whether it was time to act."""
        with self._lock:
            self._passed[way] += size
            act = None
            if self.when is not None and self.when[0] == way and self._passed[way] >= self.when[1]:
                act, self.when = self.when[2], None
        if act is not None:
            act()
        return act is not None

    def _reset_all(self) -> None:
        with self._lock:
            opened, self._open = self._open, []
        for connection in opened:
            _reset(connection)


def _reset(connection: socket.socket) -> None:
    """Close with RST; both ends of a dead connection are closed more than once."""
    with contextlib.suppress(OSError):
        linger = struct.pack("ii", 1, 0)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
    connection.close()
