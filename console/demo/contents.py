"""What stands in a room: pieces, stands and boxes in one scene, and the floor between them."""

import math

import numpy as np
import torch
from numpy.typing import NDArray

from console.demo.floor_plan import FloorPlan, Footprint
from console.demo.goals import Goal, Thing
from console.demo.layout import Layout
from console.kinds.poses import HERE
from console.kinds.setup import FAR_M, Pose
from console.play.balls import Thrower
from console.play.scene import GLIDE_M_S, GLIDE_RAD_S, STEP_S
from console.video.stage import furniture_colour
from world import rotations
from world.errors import ChoiceError, ConfigError
from world.furniture.usage import USAGES
from world.scene.batch import Scenes
from world.scene.box import STAND
from world.scene.model import FURNITURE_BODY, compile_room

Vector3 = tuple[float, float, float]
#: A box is on a stand within these distances of the centre of its top, horizontally and up, m.
_ON_M, _ON_UP_M = 0.2, 0.05
#: The first mocap bodies: the stands of a scene with one box, whose bodies have names of their own.
_STANDS = 2
#: Names of the boxes by size, in the order of the layout.
_SIZES = ("large", "small")


class Contents:
    """The things of a room in a scene; not thread-safe."""

    def __init__(self, layout: Layout, action_scale: float, action_clip: float) -> None:
        self._boxes = layout.boxes
        models = compile_room([p.piece for p in layout.pieces], layout.boxes, Thrower.balls())
        self._calm, self._carrying = models
        self.model = self._calm
        self.scenes = Scenes([self._calm], action_scale, action_clip)
        self._plan: FloorPlan | None = None
        self.stands = [
            # the first mocap bodies are the stands
            Thing(f"stand {i + 1}", STAND, i, pose, pose, layout.stand_m)
            for i, pose in enumerate(layout.stands)
        ]
        first = len(layout.stands)
        self.pieces = [
            Thing(p.name, p.piece, first + i, p.pose, p.pose) for i, p in enumerate(layout.pieces)
        ]
        for thing in self.pieces:
            body = self.model.body(f"{FURNITURE_BODY}{thing.index - _STANDS}")
            geom, count = int(body.geomadr[0]), int(body.geomnum[0])
            self.model.geom_rgba[geom : geom + count] = furniture_colour(thing.piece.name)
        self.things = {thing.name: thing for thing in (*self.pieces, *self.stands)}
        self.box_names = [f"{size} box" for size, _ in zip(_SIZES, layout.boxes, strict=True)]

    def _furnish(self) -> None:
        """Write the poses of all things, and put each box on its stand."""
        for thing in self.things.values():
            self.scenes.move_piece(HERE, thing.index, *thing.origin())
        for index in range(len(self._boxes)):
            self._put_on(index, self.stands[index])

    def _box_at(self, index: int) -> list[float]:
        """Centre of a box [3], m."""
        return self.scenes.free_qpos[0, 7 * index : 7 * index + 3].tolist()

    def box_poses(self) -> dict[str, tuple[Vector3, Vector3, float]]:
        """Centres (m), half edges (m) and yaws (rad) of the boxes by name."""
        found = {}
        for index, name in enumerate(self.box_names):
            x, y, z = self._box_at(index)
            w, _, _, along = self.scenes.free_qpos[0, 7 * index + 3 : 7 * index + 7].tolist()
            half = self._boxes[index].boxes[0].half_m
            found[name] = ((x, y, z), half, 2 * math.atan2(along, w))
        return found

    def stand_of(self, index: int) -> Thing | None:
        """The stand on which a box is; None elsewhere."""
        x, y, z = self._box_at(index)
        half = self._boxes[index].boxes[0].half_m[2]
        for stand in self.stands:
            near = math.dist((x, y), (stand.pose.x, stand.pose.y)) < _ON_M
            if near and abs(z - half - stand.up_m) < _ON_UP_M:
                return stand
        return None

    def _put_on(self, index: int, stand: Thing) -> None:
        """Put a box on a stand, at rest."""
        half = self._boxes[index].boxes[0].half_m[2]
        top, yaw = stand.origin()
        at = top + torch.tensor([[0.0, 0.0, half]])
        rotation = rotations.from_heading(yaw)
        self.scenes.set_free(HERE, index, torch.cat((at, rotation), dim=1), torch.zeros(1, 6))

    def move(self, name: str, pose: Pose) -> None:
        """Move a piece towards a pose of its origin, from the next step on.

        Raises ChoiceError for an unknown piece, ConfigError beyond the bounds.
        """
        if name not in self.things:
            raise ChoiceError("piece", name, list(self.things))
        if not all(math.isfinite(v) for v in (pose.x, pose.y, pose.yaw)):
            raise ConfigError("a pose must be finite numbers")
        if max(abs(pose.x), abs(pose.y)) > FAR_M:
            raise ConfigError(f"choose x and y within {FAR_M:g} m of the middle")
        self.things[name].wanted = pose

    def _glide(self) -> bool:
        """Move things one step towards where they are wanted, boxes with their stand; whether one
        has arrived."""
        arrived = False
        for thing in self.things.values():
            if thing.pose == thing.wanted:
                continue
            loads = [i for i in range(len(self._boxes)) if self.stand_of(i) is thing]
            thing.pose = thing.pose.stepped(thing.wanted, GLIDE_M_S * STEP_S, GLIDE_RAD_S * STEP_S)
            self.scenes.move_piece(HERE, thing.index, *thing.origin())
            for index in loads:
                self._put_on(index, thing)
            self._plan = None
            arrived |= thing.pose == thing.wanted
        return arrived

    def plan(self) -> FloorPlan:
        """The floor plan with all pieces."""
        if self._plan is None:
            self._plan = FloorPlan([Footprint.of(t.piece, t.pose) for t in self.things.values()])
        return self._plan

    def _others(self, goal: Goal) -> FloorPlan:
        """The floor plan without what the goal's policy itself steers clear of."""
        own = {thing.name for thing in goal.things}
        entry = goal.entry()
        rest = [Footprint.of(t.piece, t.pose) for t in self.things.values() if t.name not in own]
        if goal.carries:
            rest = [f for f in rest if float(f.distance_m(entry)) > 0.0]  # the box's own stand
        return FloorPlan(rest)

    def _height_at(self, root: NDArray[np.float64], thing: Thing) -> float:
        """Height of the highest box of a piece if a root [2] is over it, without its back."""
        if float(Footprint.of(thing.piece, thing.pose).distance_m(root)) > 0.0:
            return 0.0
        points = [u.point_m[2] for use in USAGES.values() for u in use.use_points(thing.piece)]
        return max(points, default=float(thing.piece.bounds()[1][2]))
