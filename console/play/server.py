"""viser's server as the player needs it: where it was told to listen, quiet, never shared."""

import socket

import rich
import viser

from console.listening import address_of, is_loopback
from world.errors import ConfigError


class Server(viser.ViserServer):
    """A viser server that opens no tunnel to anywhere, whoever asks it to."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Nothing is shared."""
        return None


def start(listen: str, allow_remote: bool = False) -> Server:
    """A server at HOST:PORT, port 0 a free one.

    Raises ConfigError where that cannot be listened on, and beyond this machine unless that is
    allowed: who reaches the page can do with the character what they like.
    """
    host, port = address_of(listen)
    if not allow_remote and not is_loopback(host):
        raise ConfigError(
            f"--listen {listen}: anyone there could play; stay on 127.0.0.1, or add "
            "--allow-insecure-remote"
        )
    try:
        # viser would silently take the next free port
        with socket.create_server((host, port)):
            pass
    except (OSError, OverflowError) as error:
        raise ConfigError(f"cannot listen on '{listen}' (HOST:PORT): {error}") from error
    # its own banners; ours is one line
    rich.get_console().quiet = True
    server = Server(host=host, port=port, label="inhabit", verbose=False)
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, control_layout="collapsible",
        control_width="medium",
    )  # fmt: skip
    return server
