"""The clock of the player: play, pause, seek in the past, continue from there."""

from console.play.source import HZ, Source
from world.errors import ConfigError

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
#: Greatest number of frames of one `advance`: a slow machine plays slower and skips no frames.
_MOST = 8


class Player:
    """The shown frame of a source, and whether it advances; not thread-safe."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.playing = True
        self.speed = 1.0
        self.frame = 0
        self._due = 0.0

    @property
    def last(self) -> int:
        """Index of the newest frame."""
        return len(self.source) - 1

    def play(self, playing: bool) -> None:
        """Play or pause; at the end of a source that cannot continue, play from its start."""
        if playing and not self.playing and self.frame == self.last:
            # the new frame is shown: else a push that follows at once would be in the past
            self.frame = self.last if self.source.extend() else 0
        self.playing, self._due = playing, 0.0

    def run(self, speed: float) -> None:
        """Play at `speed` times real time; ConfigError beyond the SPEEDS."""
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ConfigError(f"speed {speed:g}: choose {SPEEDS[0]:g} to {SPEEDS[-1]:g}")
        self.speed = speed

    def seek(self, frame: int) -> None:
        """Show an existing frame and pause."""
        self.playing = False
        self.frame = max(0, min(self.last, frame))

    def branch(self) -> None:
        """Continue from the shown frame and discard the later ones."""
        self.source.cut(self.frame)
        self.playing, self._due = True, 0.0

    def advance(self, seconds: float) -> int:
        """Advance by a time; return the number of frames.

        Existing frames are shown again, new ones are simulated; at the end the player pauses.
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
            # a source that has forgotten its oldest frames has fewer now
            self.frame = min(self.frame + 1, self.last)
            moved += 1
        return moved
