"""The page of the player: 3-D scene, time controls, plots, ghost and saving."""

import threading
from collections.abc import Callable
from html import escape
from typing import Any

import numpy as np
import torch
import viser
from numpy.typing import NDArray

from console.play import saving
from console.play.browser.drawing import Drawn
from console.play.browser.ghost import Ghost, GhostBody
from console.play.browser.plots import Plots, kind_of
from console.play.frames import Frames
from console.play.live import Live
from console.play.player import SPEEDS
from console.play.recorded import Recorded
from console.play.server import Server
from console.play.session import Session
from console.play.source import HZ, Curves
from console.video.stage import SKY_BOTTOM, SKY_TOP, Shapes
from world.errors import InhabitError
from world.realism.measures import Motion

#: Intervals at which the controls, the plots and the ghost are updated, in ticks of 1/30 s.
_CONTROLS, _PLOTS, _GHOST = 6, 12, 3
#: Initial look-at point of the camera on the floor, m: between character and target.
_MIDDLE_M = (1.2, 0.0)
#: In a narrow window: greatest factor of the camera's distance, and how far the look-at point is
#: towards the camera, as a fraction of that distance.
_FARTHEST, _BELOW = 1.9, 0.7
#: Intensity of the light from all around, beside the lamps.
_AMBIENT = 0.3


def _sky() -> NDArray[np.uint8]:
    """Return an image of the sky of films, darker above."""
    share = np.linspace(0.0, 2.5, 256).clip(max=1.0)[:, None]  # the horizon is above the middle
    rows = (1.0 - share) * np.array(SKY_TOP) + share * np.array(SKY_BOTTOM)
    return np.repeat((255.0 * rows).round().astype(np.uint8)[:, None], 4, axis=1)


class View:
    """All open pages of a session; `tick` runs in one thread, callbacks in viser's threads."""

    def __init__(self, server: Server, session: Session, title: str, plots: bool = True) -> None:
        """plots: draw the source's measures beside the scene."""
        self.server, self.session, self.title = server, session, title
        self.ghost: Ghost | None = None
        self._opened, self._ticks = -1, 0
        self._stale = True  # plots and ghost are older than the frame
        self._drawn: Drawn | None = None
        self._plots: Plots | None = None
        # Kept hidden for the next source of their kind and never removed: a busy page applies a
        # batch's updates after its removals, and would report plots that it no longer has.
        self._all_plots: dict[tuple, Plots] = {}
        self._stage()
        server.on_client_connect(self._fit_narrow)
        self.status = server.gui.add_markdown("")
        self._time_controls()
        self._measured: viser.GuiTabHandle | None = None
        if plots:
            panel = server.gui.add_panel()
            self._measured = panel.add_tab("measured")
            panel.dock_left()
            panel.set_width(330)

    def _stage(self) -> None:
        scene = self.server.scene
        scene.configure_environment_map("studio", environment_intensity=_AMBIENT)
        scene.set_background_image(_sky(), "png")
        self._world = scene.add_frame("/world", show_axes=False)
        scene.add_grid(
            "/world/floor",
            40.0,
            40.0,
            cell_size=0.5,
            section_size=1.0,
            plane_color=(226, 228, 231),
            plane_opacity=1.0,
            cell_color=(214, 216, 219),
            cell_thickness=0.6,
            section_color=(200, 203, 208),
            section_thickness=0.8,
            fade_distance=16.0,
            shadow_opacity=0.35,
        )
        self._ghost_body = GhostBody()
        self._ghost = Drawn(self.server, "/world/ghost", self._ghost_body.model, ghost=True)
        self._ghost.show(False)
        self.look((1.2, -3.4, 1.5), (*_MIDDLE_M, 0.7))

    def look(
        self, position: tuple[float, float, float], look_at: tuple[float, float, float]
    ) -> None:
        """Set the initial camera, m; in a narrow window it is farther away, and the scene above the
        panel."""
        camera = self.server.initial_camera
        camera.position, camera.look_at, camera.up = position, look_at, (0.0, 0.0, 1.0)
        self._camera = np.array(position), np.array(look_at)

    def _fit_narrow(self, client: viser.ClientHandle) -> None:
        position, look_at = self._camera
        if client.camera.aspect < 1.0:
            away = position - look_at
            client.camera.position = look_at + away * min(_FARTHEST, 1.0 / client.camera.aspect)
            client.camera.look_at = look_at + _BELOW * away * (1.0, 1.0, 0.0)

    @property
    def offset(self) -> tuple[float, float]:
        """Where the origin of the scene is drawn, m: it moves while the character is followed."""
        x, y, _ = self._world.position
        return float(x), float(y)

    def _time_controls(self) -> None:
        gui, session = self.server.gui, self.session
        with gui.add_folder("Time"):
            self._play = gui.add_button("Pause")
            self._slider = gui.add_slider("frame", 0, 1, 1, 0, hint="1/30 s each")
            self._newest = gui.add_button("To the newest")
            self._branch = gui.add_button("Continue from here", hint="discards the later frames")
            self._speed = gui.add_dropdown(
                "speed", tuple(f"{s:g}" for s in SPEEDS), initial_value="1"
            )
            self._follow = gui.add_checkbox("follow the character", False)
            self._collisions = gui.add_checkbox(
                "collision shapes", False, hint="what the simulator collides, without clothes"
            )

        def toggle(_: Any) -> None:
            session.player.play(not session.player.playing)

        def scrub(_: Any) -> None:
            session.player.seek(int(self._slider.value))

        def newest(_: Any) -> None:
            session.player.seek(session.player.last)

        self.on(self._play, toggle)
        self.on(self._slider, scrub)
        self.on(self._newest, newest)
        self.on(self._branch, lambda _: session.player.branch())
        self.on(self._follow, lambda _: None)
        self.on(self._collisions, lambda _: self._redraw())
        self.on(self._speed, lambda _: session.player.run(float(self._speed.value)))

    def offer_saving(self, recording: bool = True) -> None:
        """Add the folder of saving; recording: also as a recording."""
        gui, licence = self.server.gui, self.session.player.source.origins().get("licence")
        with gui.add_folder("Save"):
            if licence:
                # text of others is no markup
                gui.add_html(f"<small>Licence of the motion: {escape(licence)}</small>")
            page = gui.add_button("As a page (HTML)", hint="one file: replay and curves")
            packed = gui.add_button("As a recording (.msgpack)", visible=recording)

        def send(event: Any, kind: str, content: bytes) -> None:
            event.client.send_file_download(f"inhabit.{kind}", content, save_immediately=True)

        self.on(page, lambda e: send(e, "html", saving.html(self.session.player, self.title)))
        self.on(packed, lambda e: send(e, "msgpack", saving.msgpack(self.session.player)))

    def offer_ghost(self, find: Callable[[], tuple[Ghost | None, str]]) -> None:
        """Add the folder of the nearest mocap. find: returns the ghost, and a text on its clips or
        on why there is none; it may be slow and runs in a thread."""
        gui = self.server.gui
        with gui.add_folder("Nearest mocap"):
            self._ghost_on = gui.add_checkbox("show it as a ghost", False, disabled=True)
            self._match = gui.add_markdown("*reading the clips ...*")
        self.on(self._ghost_on, lambda _: None)

        def read() -> None:
            try:
                ghost, text = find()
            except InhabitError as error:
                ghost, text = None, str(error)
            with self.session.lock:
                self.ghost, self._match.content = ghost, f"*{text}*"
                self._ghost_on.disabled = ghost is None

        threading.Thread(target=read, name="ghost", daemon=True).start()

    def on(self, handle: Any, act: Callable[[Any], None]) -> None:
        """Call `act` when a control is used on a page; errors are shown there."""

        def called(event: Any) -> None:
            self.called(event, act)

        if isinstance(handle, viser.GuiButtonHandle | viser.GuiButtonGroupHandle):
            handle.on_click(called)
        else:
            handle.on_update(called)

    def called(self, event: Any, act: Callable[[Any], None]) -> None:
        """Call `act` with an event of a page; an error is shown there."""
        if event.client is None:
            return  # changed by this program
        try:
            with self.session.lock:
                act(event)
                self._ticks = 0
        except InhabitError as error:
            event.client.add_notification(
                "Not possible", str(error), color="orange", auto_close_seconds=8.0
            )

    def tick(self, seconds: float) -> None:
        """Advance the time while a page is open, and update the pages."""
        if not self.server.get_clients():
            seconds = 0.0
        with self.session.lock, self.server.atomic():
            if self._opened != self.session.opened:
                self._opened = self.session.opened
                self._redraw()
            player = self.session.player
            moved = player.advance(seconds)
            if moved or self._ticks == 0:
                self._show(player.frame)
            self._stale = self._stale or bool(moved)
            if self._ticks % _CONTROLS == 0:
                self._update_controls()
            if self._ticks % _GHOST == 0 and (self._stale or self._ticks == 0):
                self._show_ghost(player.frame)
            if self._ticks % _PLOTS == 0 and (self._stale or self._ticks == 0):
                self._draw_plots(player.frame)
                self._stale = False
            self._ticks += 1

    def _redraw(self) -> None:
        source = self.session.player.source
        if self._drawn is not None:
            self._drawn.remove()
        look: Shapes = "shapes" if self._collisions.value else "body"
        self._drawn = Drawn(self.server, "/world/scene", source.model, source.piece, look)
        weights = source.scene.task.terms if isinstance(source, Live) else {}
        if self._measured is not None:
            self._switch_plots(self._measured, source.curves(), weights)
        self._ticks = 0

    def _switch_plots(
        self, panel: viser.GuiTabHandle, curves: Curves, weights: dict[str, float]
    ) -> None:
        kind = kind_of(curves, weights)
        if kind not in self._all_plots:
            with panel:
                self._all_plots[kind] = Plots(self.server, curves, weights)
        for other, plots in self._all_plots.items():
            plots.show(other == kind)
        self._plots = self._all_plots[kind]

    def _show(self, frame: int) -> None:
        assert self._drawn is not None
        source = self.session.player.source
        self._drawn.put(source.poses(frame))
        if isinstance(source, Recorded) and source.follows:
            self._ghost.show(True)
            self._ghost.put(self._ghost_body.poses(source.followed(frame)))
        qpos, _ = source.state(frame)
        # the world is moved under the camera, whose pose is left to the user
        at = np.array(_MIDDLE_M) - qpos[:2] if self._follow.value else np.zeros(2)
        self._world.position = (float(at[0]), float(at[1]), 0.0)

    def _update_controls(self) -> None:
        player = self.session.player
        self._play.label = "Pause" if player.playing else "Play"
        if self._slider.max != max(1, player.last):
            self._slider.max = max(1, player.last)
        if int(self._slider.value) != player.frame:
            self._slider.value = player.frame
        source, frame = player.source, player.frame
        words = [f"**{frame / HZ:.2f} s** of {player.last / HZ:.2f} s", source.status(frame)]
        if isinstance(source, Frames) and source.ended and frame == player.last:
            words.append(source.ended)
        self.status.content = "\n\n".join(word for word in words if word)
        self._branch.disabled = frame == player.last or not isinstance(source, Frames)

    def _draw_plots(self, frame: int) -> None:
        if self._plots is not None:
            self._plots.draw(self.session.player.source.curves(), frame)

    def _show_ghost(self, frame: int) -> None:
        if self.ghost is None:
            return
        shown = bool(self._ghost_on.value) and frame > 0
        self._ghost.show(shown)
        if not shown:
            return
        source = self.session.player.source
        pair = [source.state(i) for i in (frame - 1, frame)]
        qpos, qvel = (torch.from_numpy(np.stack([p[i] for p in pair])) for i in (0, 1))
        match = self.ghost.nearest(Motion(qpos, qvel))
        self._ghost.put(self._ghost_body.poses(match.qpos))
        self._match.content = f"{match.clip}, {match.distance:.2f} standard deviations away"
