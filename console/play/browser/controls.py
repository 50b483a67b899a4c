"""Controls of a live scene on the page: its setup, and its disturbances."""

import math

import numpy as np

from console.kinds.setup import FAR_M, SCALES, Pose, Setup
from console.play.browser.disturbances import add_disturbances
from console.play.browser.view import View
from console.play.stock import Stock

_BOUNDS = ((-FAR_M, -FAR_M), (FAR_M, FAR_M))


class Controls:
    """Folders of controls in a view, for a session with a stock."""

    def __init__(self, view: View, stock: Stock, setup: Setup) -> None:
        self._view, self._session, self._stock = view, view.session, stock
        self._seed = setup.seed
        add_disturbances(view)
        self._goal_controls(setup)
        self._scene_controls(setup)
        self._place_handles()
        self._fit()

    def _scene_controls(self, setup: Setup) -> None:
        gui, view = self._view.server.gui, self._view
        with gui.add_folder("Scene"):
            self._policy = gui.add_dropdown(
                "policy", tuple(self._stock.policies), initial_value=setup.policy
            )
            names = tuple(self._stock.pieces(setup.policy))
            self._piece = gui.add_dropdown("piece", names, initial_value=setup.piece)
            self._scale = gui.add_slider("scale", *SCALES, 0.05, setup.scale)
            self._side = gui.add_dropdown("side", ("0",), hint="side of a bed")
            start = (setup.start.x, setup.start.y)
            self._start = gui.add_vector2(
                "start x, y (m)", start, min=_BOUNDS[0], max=_BOUNDS[1], step=0.1
            )
            self._heading = gui.add_slider("heading (°)", -180, 180, 5, _degrees(setup.start.yaw))
            self._box = gui.add_vector2(
                "box x, y (m)", (setup.box.x, setup.box.y), min=_BOUNDS[0], max=_BOUNDS[1], step=0.1
            )
            begin = gui.add_button("Start again")
            random = gui.add_button("Start anywhere", hint="another piece, 1.5 to 4 m away")
        view.on(self._policy, lambda _: self._fit(changed=True))
        view.on(self._piece, lambda _: self._fit())
        view.on(begin, lambda _: self._session.begin(self.setup()))
        view.on(random, lambda _: self._anywhere())

    def _goal_controls(self, setup: Setup) -> None:
        gui, view = self._view.server.gui, self._view
        with gui.add_folder("Target"):
            self._goal = gui.add_vector2(
                "x, y (m)", (setup.goal.x, setup.goal.y), min=_BOUNDS[0], max=_BOUNDS[1], step=0.1
            )
            self._facing = gui.add_slider("facing (°)", -180, 180, 5, _degrees(setup.goal.yaw))
            gui.add_markdown("Or drag the handles in the scene: the target follows at 1.5 m/s.")
        self._handles = view.server.scene.add_transform_controls(
            "/world/goal", 0.6, active_axes=(True, True, False), depth_test=False, opacity=0.7
        )
        view.on(self._goal, lambda _: self._move())
        view.on(self._facing, lambda _: self._move())
        view.on(self._handles, lambda _: self._dragged())

    def setup(self) -> Setup:
        """Return the setup of the controls."""
        return Setup(
            policy=str(self._policy.value),
            piece=str(self._piece.value),
            scale=float(self._scale.value),
            side=int(self._side.value),
            start=_pose(self._start.value, self._heading.value),
            goal=_pose(self._goal.value, self._facing.value),
            box=_pose(self._box.value, 180.0),
            seed=self._seed,
        )

    def _fit(self, changed: bool = False) -> None:
        """Show the options of the policy and the piece; changed: the policy is another one."""
        policy = str(self._policy.value)
        affordance = self._stock.policy(policy).task.affordance
        if changed:
            self._piece.options = tuple(self._stock.pieces(policy))
        piece = self._stock.pieces(policy)[str(self._piece.value)]
        self._side.options = tuple(str(i) for i in range(affordance.use_point_count(piece)))
        self._side.visible = len(self._side.options) > 1
        self._box.visible = affordance.cargo
        if changed:
            self._session.begin(self.setup())

    def _anywhere(self) -> None:
        self._seed += 1
        random = np.random.default_rng(self._seed)
        self._piece.value = str(random.choice(list(self._stock.pieces(str(self._policy.value)))))
        self._fit()
        distance, bearing, facing = random.uniform((1.5, -math.pi, -math.pi), (4, math.pi, math.pi))
        x, y = self._start.value
        self._goal.value = (
            round(x + distance * math.cos(bearing), 2),
            round(y + distance * math.sin(bearing), 2),
        )
        self._facing.value = round(math.degrees(facing) / 5) * 5
        # halfway to the target, clear of the character's first step
        self._box.value = (
            round(x + 0.5 * distance * math.cos(bearing), 2),
            round(y + 0.5 * distance * math.sin(bearing), 2),
        )
        self._place_handles()
        self._session.begin(self.setup())

    def _move(self) -> None:
        self._place_handles()
        self._session.move(self.setup().goal)

    def _dragged(self) -> None:
        x, y, _ = self._handles.position
        w, _, _, z = self._handles.wxyz
        yaw = 2 * math.atan2(float(z), float(w))
        goal = Pose(
            max(-FAR_M, min(FAR_M, float(x))), max(-FAR_M, min(FAR_M, float(y))),
            math.remainder(yaw, 2 * math.pi),
        )  # fmt: skip
        self._goal.value = (round(goal.x, 2), round(goal.y, 2))
        self._facing.value = _degrees(goal.yaw)
        self._session.move(goal)

    def _place_handles(self) -> None:
        goal = self.setup().goal
        self._handles.position = (goal.x, goal.y, 0.02)
        half = 0.5 * goal.yaw
        self._handles.wxyz = (math.cos(half), 0.0, 0.0, math.sin(half))


def _pose(point: tuple[float, float], degrees: float) -> Pose:
    return Pose(float(point[0]), float(point[1]), math.radians(degrees))


def _degrees(angle_rad: float) -> int:
    return round(math.degrees(math.remainder(angle_rad, 2 * math.pi)))
