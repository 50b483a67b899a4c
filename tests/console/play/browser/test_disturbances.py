"""The folder of disturbances: what its buttons do to a live scene."""

import numpy as np
import pytest

from console.play.browser.disturbances import add_disturbances
from console.play.session import Session
from tests.support.console import players
from tests.support.console.rooms import used


def test_a_push_along_the_heading_and_a_ball() -> None:
    session = Session(players.live())
    pushes: list[tuple[np.ndarray, str]] = []
    session.scene.push = lambda impulse, body: pushes.append((impulse, body))  # type: ignore
    with used(session) as view:
        add_disturbances(view)
        session.player.play(False)
        view.use("Push")
        assert session.player.playing, "it goes on"
        (impulse, body) = pushes[0]
        assert body == "torso" and impulse == pytest.approx([40.0, 0.0, 0.0])
        view.use("Throw a ball")
        session.player.advance(0.2)
        balls = session.player.source.poses(session.player.last)[-4:, :3]
        assert np.isfinite(balls).all(axis=1).sum() == 1
