"""The session of all open pages: one player, its sources, and a lock."""

import math
import threading

import numpy as np

from console.kinds.setup import Pose, Setup
from console.play.frames import Frames, Playable
from console.play.live import Live
from console.play.player import Player
from console.play.scene import Scene
from console.play.source import Source, heading
from console.play.stock import Stock
from world.errors import ChoiceError, ConfigError


class Session:
    """A player and the stock of its scenes; thread-safe."""

    def __init__(self, source: Source, stock: Stock | None = None) -> None:
        """stock: source of new scenes; None for a file."""
        self.lock = threading.RLock()
        self.stock = stock
        self.player = Player(source)
        self.opened = 0
        """Number of sources so far; pages are redrawn when it grows."""

    def open(self, source: Source) -> None:
        """Play another source from its start."""
        with self.lock:
            speed = self.player.speed
            self.player = Player(source)
            self.player.run(speed)
            self.opened += 1

    def begin(self, setup: Setup) -> None:
        """Play a new scene; InhabitError for an invalid setup, which leaves the old one."""
        if self.stock is None:
            raise ConfigError("a file is played: play a run to set up scenes")
        found = self.stock.begin(setup)
        self.open(found)

    @property
    def stepped(self) -> Playable:
        """What is simulated; ConfigError for a file."""
        source = self.player.source
        if not isinstance(source, Frames):
            raise ConfigError("a recording cannot be disturbed: play a run instead")
        return source.stepped

    @property
    def scene(self) -> Scene:
        """The live scene; ConfigError for another source."""
        source = self.player.source
        if not isinstance(source, Live):
            raise ConfigError("a recording cannot be disturbed: play a run instead")
        return source.scene

    def push(self, impulse_n_s: float, direction_rad: float, body: str) -> None:
        """Push a body horizontally, `direction_rad` from the character's heading (0: forwards,
        pi / 2: to its left)."""
        with self.lock:
            stepped = self.at_the_front()
            if not math.isfinite(impulse_n_s) or not math.isfinite(direction_rad):
                raise ConfigError("a push must be finite numbers")
            qpos, _ = self.player.source.state(self.player.frame)
            angle = heading(qpos) + direction_rad
            along = np.array([math.cos(angle), math.sin(angle), 0.0])
            stepped.push(impulse_n_s * along, body)

    def throw(self) -> None:
        """Throw a ball at the character."""
        with self.lock:
            self.at_the_front().throw()

    def move(self, goal: Pose) -> None:
        """Move the furniture, or the target stand of the box, towards another pose."""
        with self.lock:
            self.at_the_front()
            self.scene.move(goal)

    def at_the_front(self) -> Playable:
        """What is simulated, for a change to it; ConfigError while a past frame is shown."""
        stepped = self.stepped
        if self.player.frame < self.player.last:
            raise ConfigError(
                "this frame is in the past: choose 'Continue from here' or 'To the newest' first"
            )
        return stepped

    def use(self, names: dict[str, Source], name: str) -> None:
        """Play one of several sources; ChoiceError names them."""
        if name not in names:
            raise ChoiceError("take", name, list(names))
        self.open(names[name])
