"""The player's clock: plays, pauses, goes back over what was, and goes on from there."""

from console.play.source import HZ, Source
from world.errors import ConfigError

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
#: Frames of one `advance` at most: where the machine is too slow, time is given up, not the frames.
_MOST = 8


class Player:
    """Which frame of a source is shown, and whether it moves; not to be shared between threads."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.playing = True
        self.speed = 1.0
        self.frame = 0
        self._due = 0.0

    @property
    def last(self) -> int:
        """The newest frame."""
        return len(self.source) - 1

    def play(self, playing: bool) -> None:
        """Go or pause; at the end of what cannot go on, from its beginning."""
        if playing and not self.playing and self.frame == self.last and not self.source.extend():
            self.frame = 0
        self.playing, self._due = playing, 0.0

    def run(self, speed: float) -> None:
        """Play at `speed` times real time; ConfigError beyond the SPEEDS."""
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ConfigError(f"speed {speed:g}: choose {SPEEDS[0]:g} to {SPEEDS[-1]:g}")
        self.speed = speed

    def seek(self, frame: int) -> None:
        """Show a frame that was, and stay there."""
        self.playing = False
        self.frame = max(0, min(self.last, frame))

    def branch(self) -> None:
        """Go on from the frame that is shown; what came after it is forgotten."""
        self.source.cut(self.frame)
        self.playing, self._due = True, 0.0

    def advance(self, seconds: float) -> int:
        """Let so much time pass; returns by how many frames that moved.

        Frames that were are shown again, new ones are simulated; at the end of both it pauses.
        """
        if not self.playing:
            return 0
        self._due += seconds * self.speed * HZ
        moved, wanted = 0, min(int(self._due), _MOST)
        self._due -= int(self._due)
        while moved < wanted:
            if self.frame == self.last and not self.source.extend():
                self.playing = False
                break
            self.frame += 1
            moved += 1
        return moved
