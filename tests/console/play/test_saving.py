"""What is saved plays again."""

from pathlib import Path

import numpy as np
import pytest

from console.play import recorded, saving
from console.play.player import Player
from console.play.session import Session
from tests.support.console.players import live
from world.character import model as character
from world.errors import ConfigError


@pytest.mark.parametrize("task", ["sit", "carry"])
def test_what_is_saved_plays_again(task: str, tmp_path: Path) -> None:
    source = live(task)
    source.scene.throw()
    for _ in range(12):
        source.extend()
    path = tmp_path / "kept.msgpack"
    path.write_bytes(saving.msgpack(Player(source)))
    ((name, again),) = recorded.read(path).items()
    assert source.scene.piece.name in name and len(again) == 13
    body = [source.model.body(n).id for n in (*character.BODIES, "furniture")]
    ball = source.model.body("projectile0").id
    for frame in (0, 5, 12):
        ours, theirs = source.poses(frame), again.poses(frame)
        np.testing.assert_allclose(theirs[body], ours[body], atol=1e-9)
        np.testing.assert_allclose(theirs[ball, :3], ours[ball, :3])
    was, now = source.curves(), again.curves()
    assert list(was.terms) == list(now.terms) and was.error_m is not None
    for term in was.terms:
        np.testing.assert_allclose(now.terms[term], was.terms[term], atol=1e-4)
    np.testing.assert_allclose(now.error_m, was.error_m, atol=1e-4)
    with pytest.raises(ConfigError, match="cannot be continued"):
        again.cut(3)
    with pytest.raises(ConfigError, match="cannot be disturbed"):
        Session(again).throw()
