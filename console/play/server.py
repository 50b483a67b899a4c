"""viser's server for the player: on a given address, quiet, without tunnels."""

import socket

import rich
import viser

from console.listening import address_of, family, is_loopback, refused
from world.errors import ConfigError


class Server(viser.ViserServer):
    """A viser server that never opens a tunnel to another host."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Return None: the page is not shared."""
        return None


def start(listen: str, allow_remote: bool = False) -> Server:
    """Return a server at HOST:PORT, port 0 for a free port.

    Raises ConfigError for an unusable address, and for one beyond this machine unless remote
    access is allowed: the page has no authentication.
    """
    host, port = address_of(listen)
    if not allow_remote and not is_loopback(host):
        raise ConfigError(
            f"--listen {listen}: the page has no authentication; use 127.0.0.1, or add "
            "--allow-insecure-remote"
        )
    try:
        # viser silently takes the next free port
        with socket.create_server((host, port), family=family(host)):
            pass
    except (OSError, OverflowError) as error:
        raise refused(listen, error) from error
    # viser's own banners are suppressed
    rich.get_console().quiet = True
    server = Server(host=host, port=port, label="inhabit", verbose=False)
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, control_layout="collapsible",
        control_width="medium",
    )  # fmt: skip
    return server
