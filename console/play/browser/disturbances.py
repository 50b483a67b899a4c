"""The folder of disturbances on the page of a live scene: pushes and balls."""

import math
from typing import Any

from console.play.browser.view import View
from console.play.pushes import MAX_IMPULSE_N_S
from world.character import model as character


def add_disturbances(view: View) -> None:
    """Add the folder to a view."""
    gui, session = view.server.gui, view.session
    with gui.add_folder("Disturb"):
        size = gui.add_slider("impulse (N s)", 0, MAX_IMPULSE_N_S, 5, 40)
        direction = gui.add_slider(
            "direction (°)", -180, 180, 15, 0, hint="0: forwards, 90: to its left"
        )
        body = gui.add_dropdown("body", character.BODIES, initial_value="torso")
        push = gui.add_button("Push")
        throw = gui.add_button("Throw a ball", hint="1.2 kg at 10 m/s, from any side")

    def pushed(_: Any) -> None:
        angle = math.radians(direction.value)
        session.push(float(size.value), angle, str(body.value))
        session.player.play(True)

    def thrown(_: Any) -> None:
        session.throw()
        session.player.play(True)

    view.on(push, pushed)
    view.on(throw, thrown)
