"""Controls of the demo's page: where the character goes, what disturbs it, and the furniture."""

import math
from typing import Any

import numpy as np
import viser

from console.demo import picking
from console.demo.picking import Block
from console.demo.room import Room
from console.kinds.setup import FAR_M, Pose
from console.play.browser.disturbances import add_disturbances
from console.play.browser.view import View

_NOTHING = "nothing"
_BOUNDS = ((-FAR_M, -FAR_M), (FAR_M, FAR_M))
#: The middle of the room, as a place to walk to.
_MIDDLE = "the middle"


class RoomControls:
    """Folders of controls in a view of a room."""

    def __init__(self, view: View, room: Room, missing: str) -> None:
        """missing: text on the tasks without a policy, or empty."""
        self._view, self._room, self._session = view, room, view.session
        self._goal_controls(missing)
        add_disturbances(view)
        self._furniture_controls()
        view.server.scene.on_click()(self._clicked)

    def _goal_controls(self, missing: str) -> None:
        gui, view = self._view.server.gui, self._view
        with gui.add_folder("Where to", order=-1.0):
            gui.add_markdown("Click furniture, a box or the floor; or choose:")
            for policy, names in self._room.goals().items():
                group = gui.add_button_group(policy, tuple(names or [_MIDDLE]))
                view.on(group, lambda event, policy=policy: self._chosen(policy, event))
            self._wanders = gui.add_checkbox("let it choose", self._room.wanders)
            if missing:
                gui.add_markdown(missing)
        view.on(self._wanders, lambda _: self._wander())

    def _furniture_controls(self) -> None:
        gui, view = self._view.server.gui, self._view
        with gui.add_folder("Move furniture", expand_by_default=False):
            self._moved = gui.add_dropdown("piece", (_NOTHING, *self._room.things))
            self._at = gui.add_vector2(
                "x, y (m)", (0.0, 0.0), min=_BOUNDS[0], max=_BOUNDS[1], step=0.1
            )
            self._turned = gui.add_slider("turn (°)", -180, 180, 5, 0)
            gui.add_markdown("Or drag the handles: it moves at 1.5 m/s.")
        self._handles = view.server.scene.add_transform_controls(
            "/world/moved", 0.6, active_axes=(True, True, False), depth_test=False, opacity=0.7,
            visible=False,
        )  # fmt: skip
        view.on(self._moved, lambda _: self._select())
        view.on(self._at, lambda _: self._move())
        view.on(self._turned, lambda _: self._move())
        view.on(self._handles, lambda _: self._dragged())

    def _wander(self) -> None:
        self._room.wanders = bool(self._wanders.value)
        self._session.player.play(True)

    def _sent(self) -> None:
        """A person has chosen: the character does not choose until told to."""
        self._wanders.value = self._room.wanders = False
        self._session.player.play(True)

    def _chosen(self, policy: str, event: Any) -> None:
        self._session.at_the_front()
        name = str(event.target.value)
        if name == _MIDDLE:
            self._walk(0.0, 0.0)
        else:
            self._room.send(policy, name)
        self._sent()

    def _walk(self, x: float, y: float) -> None:
        """Walk to a point and stay as it comes: its facing is the direction of the way."""
        root = self._room.root()
        self._room.walk(Pose(x, y, math.atan2(y - root[1], x - root[0])))

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        def act(_: Any) -> None:
            x, y = self._view.offset
            origin = np.array(event.ray_origin) - [x, y, 0.0]
            found = picking.picked(self.blocks(), origin, np.array(event.ray_direction))
            if found is None:
                return
            name, point = found
            self._session.at_the_front()
            policy = next((p for p, names in self._room.goals().items() if name in names), None)
            if policy is not None:
                self._room.send(policy, name)
            elif max(map(abs, point)) < FAR_M:
                self._walk(*point)
            self._sent()

        self._view.called(event, act)

    def blocks(self) -> dict[str, Block]:
        """What can be clicked, by name: the bounding boxes of pieces, stands and boxes."""
        room, found = self._room, {}
        for thing in room.things.values():
            low, high = (tuple(end.tolist()) for end in thing.piece.bounds())
            at = (thing.pose.x, thing.pose.y, thing.up_m)
            found[thing.name] = Block(low, high, at, thing.pose.yaw)
        for name, (centre, half, yaw) in room.box_poses().items():
            low = (-half[0], -half[1], -half[2])
            found[name] = Block(low, half, centre, yaw)
        return found

    def _select(self) -> None:
        name = str(self._moved.value)
        self._handles.visible = name != _NOTHING
        if name != _NOTHING:
            pose = self._room.things[name].wanted
            self._show(pose)
            self._place_handles(pose)

    def _show(self, pose: Pose) -> None:
        self._at.value = (round(pose.x, 2), round(pose.y, 2))
        self._turned.value = round(math.degrees(math.remainder(pose.yaw, 2 * math.pi)))

    def _move(self) -> None:
        if (name := str(self._moved.value)) == _NOTHING:
            return
        x, y = self._at.value
        pose = Pose(float(x), float(y), math.radians(self._turned.value))
        self._place_handles(pose)
        self._session.at_the_front()
        self._room.move(name, pose)
        self._session.player.play(True)

    def _dragged(self) -> None:
        x, y, _ = self._handles.position
        w, _, _, z = self._handles.wxyz
        pose = Pose(
            max(-FAR_M, min(FAR_M, float(x))), max(-FAR_M, min(FAR_M, float(y))),
            math.remainder(2 * math.atan2(float(z), float(w)), 2 * math.pi),
        )  # fmt: skip
        self._show(pose)
        self._session.at_the_front()
        self._room.move(str(self._moved.value), pose)
        self._session.player.play(True)

    def _place_handles(self, pose: Pose) -> None:
        self._handles.position = (pose.x, pose.y, 0.02)
        self._handles.wxyz = (math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2))
