"""Time passes as it is told to."""

import math

import pytest

from console.play.player import Player
from console.play.source import Curves
from world.errors import ConfigError


class Counted:
    """A source of so many frames."""

    def __init__(self, frames: int) -> None:
        self.frames = frames

    def __len__(self) -> int:
        return self.frames

    def extend(self) -> bool:
        return False

    def curves(self) -> Curves:
        return Curves()


def test_time_advances_by_the_requested_steps() -> None:
    player = Player(Counted(100))  # pyright: ignore
    assert [player.advance(1 / 60) for _ in range(6)] == [0, 1, 0, 1, 0, 1]
    player.run(2.0)
    assert player.advance(0.1 + 1e-9) == 6 and player.frame == 9
    player.run(0.1)
    assert sum(player.advance(0.1) for _ in range(40)) == pytest.approx(12, abs=1)
    player.run(4.0)
    assert player.advance(5.0) == 8, "a slow machine gives up time, not frames"
    for wrong in (0.0, 9.0, math.nan):
        with pytest.raises(ConfigError, match=r"choose 0\.1 to 4"):
            player.run(wrong)
    player.seek(500)
    assert player.frame == 99
    player.play(True)
    assert player.frame == 0 and player.playing, "from the beginning"
    player.seek(98)
    player.play(True)
    assert player.advance(1.0) == 1 and not player.playing


def test_playing_from_the_newest_frame_shows_the_next_one() -> None:
    """A push that follows at once is not in the past."""

    class Growing(Counted):
        def extend(self) -> bool:
            self.frames += 1
            return True

    player = Player(Growing(3))  # pyright: ignore
    player.seek(2)
    player.play(True)
    assert player.frame == player.last == 3
    still = Player(Counted(3))  # pyright: ignore
    still.seek(2)
    still.play(True)
    assert still.frame == 0, "from its start, where it cannot go on"
