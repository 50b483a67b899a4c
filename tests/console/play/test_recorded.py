"""Clips and recordings in the player."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.play import recorded, saving
from console.play.player import Player
from console.recording import format as recording
from console.recording.format import Recording
from tests.support import small_clips
from tests.support.console.recordings import take
from world.errors import ConfigError
from world.motions import load


def test_clips_and_recordings_without_a_goal_play_without_curves(tmp_path: Path) -> None:
    folder = small_clips.write(tmp_path)
    file = sorted(folder.glob("*.npz"))[0]
    found = recorded.read(file)
    clip = load.read(file)
    source = next(iter(found.values()))
    assert "no goal" in source.curves().missing and source.status(0) == ""
    np.testing.assert_allclose(source.state(0)[0][7:], clip.qpos()[0][7:], atol=1e-3)
    with pytest.raises(ConfigError, match="only what has a goal can be exported"):
        saving.html(Player(source), "t")
    stray = tmp_path / "stray.msgpack"
    recording.write(stray, Recording([replace(take(), piece="stool-mine-1")], {"task": "sit"}))
    (other,) = recorded.read(stray).values()
    assert "no reward terms: unknown split 'mine'" in other.curves().missing
    assert np.isfinite(other.poses(0)).all()
