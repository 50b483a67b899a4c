"""How an episode of carrying starts: from a clip's own state with its box, or upright with the box
on a stand anywhere near.

A start is a pure function of (seed, scene, episode).
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.initial.reference import LIFT_M, Drawn, States, course, unit
from world.motions.library import MotionLibrary
from world.motions.use import CONTACT, BoxFrames
from world.objects import grasp
from world.objects.box_bank import BoxBank, Layout
from world.scene.batch import Scenes
from world.scene.box import FRICTION
from world.tasks.task import BoxState, Place

#: The box' least distance from a standing character: its edge is this far from the root, m.
_CLEAR_M = 0.35
#: Its target's, from where the character starts, m.
_TARGET_CLEAR_M = 0.8
#: A stand that is not to be in the way is this far behind the character, m.
_AWAY_M = 6.0
#: How far above its stand a box is set down, m: contacts start unloaded.
_BOX_LIFT_M = 0.001
_GRAVITY_M_S2 = 9.81
#: A hand presses this many times as hard as the weight needs, and so many N more.
_GRIP, _GRIP_N = 3.0, 15.0
#: Of a clip that puts its box down: from this near to where, m, it is about to, or has.
_PUTTING_M = 0.6


@dataclass(frozen=True)
class BoxStarts:
    """First states of m episodes, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: the box, by number in the bank."""
    kind: Tensor
    """[m] int64: index into world.initial.furniture.KINDS."""
    frame: Tensor
    """[m] int64: the state's frame in the motion library; −1 for the rest pose."""
    layout: Layout


class BoxStarter:
    """Draws the starts of a shard's episodes of carrying."""

    def __init__(
        self, config: WorldConfig, library: MotionLibrary, bank: BoxBank, seed: int
    ) -> None:
        """Raises ClipError where clip starts are wanted and no clip carries a box, ConfigError
        where the shares make no sense."""
        self._config, self._library, self._bank, self._seed = config, library, bank, seed
        self._states = States(config, library)

    def draw(self, scenes: Tensor, episodes: Tensor) -> BoxStarts:
        """The starts of the given scene ids [m] and episode numbers [m] (int64 both)."""
        u = random_streams.uniform(self._seed, random_streams.EPISODE, scenes, episodes, 16)
        drawn = self._states.draw(u)
        from_clip, box = drawn.kind == 0, self._library.box
        variant = (u[:, 4] * len(self._bank)).long().clamp_max(len(self._bank) - 1)
        if box is not None:
            fitting = self._bank.of_width(box.size[drawn.frame, 1], u[:, 4])
            variant = torch.where(from_clip, fitting, variant)
        layout = self._on_stands(drawn, variant, u)
        if box is not None and bool(from_clip.any()):
            taken = self._from_clips(drawn, box, variant, u)
            layout = _where(from_clip, taken, layout)
        qpos, qvel = drawn.above_origin(), drawn.qvel
        in_hand = ~from_clip & (u[:, 15] < self._config.carry.in_hand)
        if bool(in_hand.any()):
            held = self._in_hand(qpos, qvel, self._bank.half[variant], u)
            layout = _where(in_hand, held, layout)
            bent = grasp.holding(qpos, _box(self._bank.place(variant, layout)))
            qpos = torch.where(in_hand[:, None], bent, qpos)
        return BoxStarts(qpos, qvel, variant, drawn.kind, drawn.named_frame(), layout)

    def place(self, starts: BoxStarts) -> Place:
        """What the task knows of the boxes of `starts`."""
        return self._bank.place(starts.variant, starts.layout)

    def put(self, scenes: Scenes, ids: Tensor, starts: BoxStarts) -> None:
        """Set the scenes `ids` [m] up as `starts` has them; their models are there already."""
        layout = starts.layout
        scenes.set_down(ids, starts.qpos, starts.qvel, layout.start, layout.start_yaw)
        self._bank.put(scenes, ids, starts.variant, layout)

    def load_n(self, starts: BoxStarts) -> tuple[Tensor, Tensor]:
        """What each hand presses on the box with, and what the box weighs, N: [m] each; 0 where it
        is not in hand."""
        box = self._library.box
        held = torch.zeros_like(starts.frame, dtype=torch.bool)
        if box is not None:
            held = (starts.kind == 0) & (starts.frame >= 0) & box.held[starts.frame]
        weight = torch.where(held, self._bank.mass[starts.variant] * _GRAVITY_M_S2, 0.0)
        return _GRIP * weight / (2.0 * FRICTION) + torch.where(held, _GRIP_N, 0.0), weight

    def _on_stands(self, drawn: Drawn, variant: Tensor, u: Tensor) -> Layout:
        """Boxes on stands about a standing character: near or far, at any bearing and yaw."""
        config, half, kind = self._config, self._bank.half[variant], drawn.kind
        low = torch.where(kind == 1, config.near_m[0], config.far_m[0])
        high = torch.where(kind == 1, config.near_m[1], config.far_m[1])
        distance = low + (high - low) * u[:, 5]
        distance = distance.maximum(half[:, :2].norm(dim=1) + _CLEAR_M)
        onwards = rotations.turn(course(drawn.qpos, drawn.qvel), unit((u[:, 6] - 0.5) / 4))
        ahead = ((kind == 2) & (u[:, 8] < config.ahead)) | ((kind == 1) & (u[:, 8] < config.front))
        bearing = torch.where(ahead[:, None], onwards, unit(u[:, 6]))
        here = distance[:, None] * bearing
        start = torch.cat((here, self._rest_height(half, u[:, 9])), dim=1)
        target = self._target(start, half, u[:, 10:13])
        yaw = unit(u[:, 7])
        lifted = start + start.new_tensor((0.0, 0.0, _BOX_LIFT_M))
        return Layout(
            lifted, rotations.from_heading(yaw), start.new_zeros(len(start), 6), start, yaw, target
        )

    def _rest_height(self, half: Tensor, u: Tensor) -> Tensor:
        """[m, 1]: height of a box' centre on a stand, m."""
        low, high = self._config.carry.stand_m
        return half[:, 2:] + (low + (high - low) * u)[:, None]

    def _target(self, start: Tensor, half: Tensor, u: Tensor) -> Tensor:
        """[m, 3]: a target at any bearing from the box, but not where the character stands."""
        low, high = self._config.carry.target_m
        offset = (low + (high - low) * u[:, :1]) * unit(u[:, 1])
        there = start[:, :2] + offset
        blocked = there.norm(dim=1) < _TARGET_CLEAR_M
        # the mirrored place is clear: the box is not at the character's feet
        there = torch.where(blocked[:, None], start[:, :2] - offset, there)
        return torch.cat((there, self._rest_height(half, u[:, 2])), dim=1)

    def _ahead(self, heading: Tensor, half: Tensor, u: Tensor) -> Tensor:
        """[m, 3]: targets of a box in hand, ahead of the character, some of them within reach."""
        carry = self._config.carry
        reach = u[:, 13] < carry.near_target
        low = torch.where(reach, carry.near_target_m[0], carry.target_m[0])
        high = torch.where(reach, carry.near_target_m[1], carry.target_m[1])
        spread = torch.where(reach, 1.0 / 9.0, 0.5)
        bearing = rotations.turn(heading, unit((u[:, 11] - 0.5) * spread))
        ahead = (low + (high - low) * u[:, 10])[:, None] * bearing
        return torch.cat((ahead, self._rest_height(half, u[:, 12])), dim=1)

    def _in_hand(self, qpos: Tensor, qvel: Tensor, half: Tensor, u: Tensor) -> Layout:
        """Boxes held before upright characters, moving along with them; the stands that they were
        picked up from are behind."""
        heading = rotations.heading(qpos[:, 3:7])
        position = grasp.before(qpos[:, :3], heading, half[:, 0])
        behind = torch.cat((-_AWAY_M * heading, self._rest_height(half, u[:, 9])), dim=1)
        velocity = torch.cat((qvel[:, :3], torch.zeros_like(qvel[:, :3])), dim=1)
        rotation = rotations.from_heading(heading)
        return Layout(position, rotation, velocity, behind, heading, self._ahead(heading, half, u))

    def _from_clips(self, drawn: Drawn, box: BoxFrames, variant: Tensor, u: Tensor) -> Layout:
        """The boxes of the clips' frames; what is not known of a clip is drawn."""
        half, frame, held = self._bank.half[variant], drawn.frame, drawn.stage == CONTACT
        root = drawn.frames.qpos[:, :3]
        origin = torch.cat((root[:, :2], torch.zeros_like(root[:, :1])), dim=1)
        position = box.position[frame] - origin
        picked = box.picked[frame, :3] - origin
        yaw = torch.stack((box.picked[frame, 3].cos(), box.picked[frame, 3].sin()), dim=1)
        put = box.put[frame, :3] - origin
        from_start = (position - picked)[:, :2].norm(dim=1)
        putting = box.has_put[frame] & ((position - put)[:, :2].norm(dim=1) < _PUTTING_M)
        putting &= ~box.has_picked[frame] | (from_start > _PUTTING_M)
        # a stand of which the clip knows nothing, or that the box has left, is out of the way
        unknown = ~box.has_picked[frame] | (putting & (from_start < 1.0))
        heading = rotations.heading(drawn.frames.qpos[:, 3:7])
        behind = -_AWAY_M * heading
        away = torch.cat((behind, picked[:, 2:]), dim=1)
        start = torch.where(unknown[:, None], away, picked)
        ahead = self._ahead(heading, half, u)
        onwards = torch.where(held[:, None], ahead, self._target(picked, half, u[:, 10:13]))
        target = torch.where(putting[:, None], put, onwards)
        velocity = torch.cat((box.velocity[frame], box.angular[frame]), dim=1)
        moving = box.held[frame]
        velocity = torch.where(moving[:, None], velocity, torch.zeros_like(velocity))
        lift = torch.where(moving, LIFT_M, LIFT_M + _BOX_LIFT_M)
        raised = torch.cat((position[:, :2], position[:, 2:] + lift[:, None]), dim=1)
        return Layout(raised, box.rotation[frame], velocity, start, yaw, target)


def _box(place: Place) -> BoxState:
    assert place.box is not None, "a bank of boxes places boxes"
    return place.box


def _where(condition: Tensor, yes: Layout, no: Layout) -> Layout:
    """Rows of `yes` where condition [m] holds, of `no` elsewhere."""
    return Layout(
        *(
            torch.where(condition[:, None], getattr(yes, name), getattr(no, name))
            for name in Layout.__dataclass_fields__
        )
    )
