"""What every open page looks at together: one player, its past, and who may touch it when."""

import math
import threading

import numpy as np

from console.kinds.setup import Pose, Setup
from console.play.live import Live
from console.play.player import Player
from console.play.scene import Scene
from console.play.source import Source, heading
from console.play.stock import Stock
from world.errors import ChoiceError, ConfigError


class Session:
    """A player and what it can be given to play; every method may be called by any thread."""

    def __init__(self, source: Source, stock: Stock | None = None) -> None:
        """stock: where scenes come from; None where a file is played."""
        self.lock = threading.RLock()
        self.stock = stock
        self.player = Player(source)
        self.opened = 0
        """How many sources there were: a page draws anew when it grows."""

    def open(self, source: Source) -> None:
        """Play something else from its beginning."""
        with self.lock:
            speed = self.player.speed
            self.player = Player(source)
            self.player.run(speed)
            self.opened += 1

    def begin(self, setup: Setup) -> None:
        """Play a new scene; InhabitError, and the old one stays, where there is none such."""
        if self.stock is None:
            raise ConfigError("a file is played: begin with a run to set up scenes")
        found = self.stock.begin(setup)
        self.open(found)

    @property
    def scene(self) -> Scene:
        """The scene that is simulated; ConfigError where a file is played."""
        source = self.player.source
        if not isinstance(source, Live):
            raise ConfigError("a recording cannot be touched: play a run instead")
        return source.scene

    def push(self, impulse_n_s: float, direction_rad: float, body: str) -> None:
        """Push a body along the floor, `direction_rad` from the character's heading (0: forwards,
        a quarter turn: to its left)."""
        with self.lock:
            scene = self._at_the_front()
            if not math.isfinite(impulse_n_s) or not math.isfinite(direction_rad):
                raise ConfigError("a push must be finite numbers")
            qpos, _ = self.player.source.state(self.player.frame)
            angle = heading(qpos) + direction_rad
            along = np.array([math.cos(angle), math.sin(angle), 0.0])
            scene.push(impulse_n_s * along, body)

    def throw(self) -> None:
        """Throw a ball at the character."""
        with self.lock:
            self._at_the_front().throw()

    def move(self, goal: Pose) -> None:
        """Have the furniture, or the stand that the box goes to, glide to another place."""
        with self.lock:
            self._at_the_front().move(goal)

    def _at_the_front(self) -> Scene:
        scene = self.scene
        if self.player.frame < self.player.last:
            raise ConfigError(
                "this moment is past: choose 'go on from here', or go to the newest one, first"
            )
        return scene

    def use(self, names: dict[str, Source], name: str) -> None:
        """Play one of several; ChoiceError names them."""
        if name not in names:
            raise ChoiceError("take", name, list(names))
        self.open(names[name])
