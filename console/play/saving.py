"""Export of a player's frames as bytes of a page or a recording."""

import tempfile
from pathlib import Path

from console.play.live import Live
from console.play.page import page
from console.play.player import Player
from console.play.source import HZ
from console.recording import format as recording
from console.recording.format import Recording


def html(player: Player, title: str) -> bytes:
    """Return all frames as an HTML file; ConfigError for a source without a target."""
    about = f"{(player.last + 1) / HZ:.1f} s"
    if isinstance(player.source, Live):
        scene = player.source.scene
        about = f"{scene.task.name}, {scene.piece.name} at {scene.setup.scale:g}, {about}"
    if licence := player.source.origins().get("licence"):
        about += f". Licence of the motion: {licence}"
    return page(player.source, title, about).encode()


def msgpack(player: Player) -> bytes:
    """Return all frames as a recording of one take."""
    meta: dict[str, object] = {"control_hz": HZ, **player.source.origins()}
    if isinstance(player.source, Live):
        scene = player.source.scene
        meta |= {"task": scene.task.name, "checkpoint": scene.served.version}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "take.msgpack"
        recording.write(path, Recording([player.source.take()], meta))
        return path.read_bytes()
