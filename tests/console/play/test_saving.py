"""What is saved plays again."""

from dataclasses import replace
from html import escape
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
    assert list(was.terms) == list(now.terms)
    assert was.error_m is not None and now.error_m is not None
    for term in was.terms:
        np.testing.assert_allclose(now.terms[term], was.terms[term], atol=1e-4)
    np.testing.assert_allclose(now.error_m, was.error_m, atol=1e-4)
    with pytest.raises(ConfigError, match="cannot be continued"):
        again.cut(3)
    with pytest.raises(ConfigError, match="cannot be disturbed"):
        Session(again).throw()


def test_what_is_saved_states_the_licence_of_policy_and_piece(tmp_path: Path) -> None:
    source = live()
    notes = {"data": "Zoo walks", "licence": "Zoo Licence 2.1, <no> derivatives"}
    served, piece = source.scene.served, source.scene.piece
    source.scene.served = replace(served, manifest=replace(served.manifest, notes=notes))
    source.extend()
    assert source.origins() == {"trained_on": "Zoo walks", "licence": notes["licence"]}
    source.scene.piece = replace(piece, licence="CC-BY-NC-4.0", credit="Ada")
    said = f"{notes['licence']}; furniture {piece.name}: CC-BY-NC-4.0, Ada"
    player = Player(source)
    text = saving.html(player, "x").decode()
    assert escape(f"Licence of the motion: {said}", quote=False) in text.replace("&#x27;", "'")
    path = tmp_path / "kept.msgpack"
    path.write_bytes(saving.msgpack(player))
    ((_, again),) = recorded.read(path).items()
    assert again.origins() == {"trained_on": "Zoo walks", "licence": said}
    # what is saved of a recording states it again
    assert escape(said, quote=False) in saving.html(Player(again), "x").decode()
