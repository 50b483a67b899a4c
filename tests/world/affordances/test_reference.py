"""Clips to follow bring their objects along: none can be chosen."""

from pathlib import Path

import pytest

from tests.support import small_clips
from world.affordances import REFERENCE
from world.config import WorldConfig
from world.errors import ConfigError
from world.tracking.bank import TrackBank

TRACK = WorldConfig(task="track")


def test_objects_are_refused() -> None:
    assert REFERENCE.pieces(TRACK) == ((), "")
    for refused in (
        lambda: REFERENCE.pieces(WorldConfig(objects=("train",))),
        lambda: REFERENCE.trial_pieces("test", 4, 0, TRACK),
        lambda: REFERENCE.choices("test"),
    ):
        with pytest.raises(ConfigError, match="choose clips with --motions"):
            refused()


def test_a_bank_has_the_clips_of_the_world(tmp_path: Path) -> None:
    folder = small_clips.write(tmp_path)
    bank = REFERENCE.bank(WorldConfig(task="track", motions=(str(folder),), mirror=False))
    assert isinstance(bank, TrackBank) and len(bank) > 0
    assert len(bank.models) == len(bank.pieces) == len(bank)
