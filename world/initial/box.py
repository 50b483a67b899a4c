"""Initial states of carrying: reference states with the clip's box, and upright states with the box
on a stand anywhere.

An initial state is a pure function of (seed, scene, episode).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.initial.focus import chosen, focused
from world.initial.reference import LIFT_M, CharacterSampler, CharacterStates, course, unit
from world.motions.library import MotionLibrary
from world.motions.uses.box import stands_away
from world.motions.uses.use import CONTACT, BoxFrames
from world.objects import grasp
from world.objects.box_bank import BoxBank, Layout
from world.scene.batch import Scenes
from world.scene.box import BOX_SIZE_M, FRICTION
from world.scene.target import BoxState, Target

#: Least distance of the box's edge from the root of a standing character, m.
_CLEAR_M = 0.35
#: Least distance of its target from the character's initial position, m.
_TARGET_CLEAR_M = 0.8
#: A box in front of a near character is turned by up to half of this off its long side, in turns.
_SQUARED_TURN = 1.0 / 9.0
#: An unused stand is this far behind the character, m.
_AWAY_M = 6.0
#: Initial height of a box above its stand, m: contacts begin unloaded.
_BOX_LIFT_M = 0.001
_GRAVITY_M_S2 = 9.81
#: A hand presses with this multiple of the force that the weight needs, plus so many N.
_GRIP, _GRIP_N = 3.0, 15.0
#: Half the height of the default box, m.
_DEFAULT_HALF_M = 0.5 * BOX_SIZE_M[2]
#: A clip that puts its box down is doing so within this of the final position, m.
_PUTTING_M = 0.6
#: Boxes are counted together in so many groups, by weight: each alone would have too few episodes.
_GROUPS = 8
#: Under this name episodes tell the group of their box, and failure rates come.
_TOLD = "piece_carry"


@dataclass(frozen=True)
class BoxInitialStates:
    """Initial states of m episodes, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: the box, by number in the bank."""
    kind: Tensor
    """[m] int64: index into world.initial.reference.KINDS."""
    frame: Tensor
    """[m] int64: the state's frame in the motion library; −1 for the rest pose."""
    layout: Layout
    """Of the boxes and their stands."""

    @property
    def place(self) -> tuple[Tensor, Tensor]:
        """Floor point [m, 2] m of the object and its facing [m, 2], which a move begins from."""
        return self.layout.start[:, :2], self.layout.start_yaw


class BoxSampler:
    """Draws the initial states of carrying; an InitialStateSampler, an AdaptiveSampler."""

    def __init__(
        self, config: WorldConfig, library: MotionLibrary, bank: BoxBank, seed: int
    ) -> None:
        """Raises ClipError where reference states are configured and no clip carries a box,
        ConfigError for invalid fractions."""
        self._config, self._library, self._bank, self._seed = config, library, bank, seed
        self._character = CharacterSampler(config, library)
        pool = torch.cat(library.start_stages)
        held = pool if library.box is None else pool[library.box.held[pool]]
        #: Frames in which a clip puts its box down.
        self._late = held[:0] if library.box is None else held[_putting(library.box, held)[0]]
        rank = bank.mass.argsort(stable=True).argsort()
        self._group = rank * min(_GROUPS, len(bank)) // len(bank)
        self._weight: Tensor | None = None

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Draw more often, in near and far states, boxes of groups whose recent failure rates [P],
        `piece_carry`, are high."""
        if (rates := published.get(_TOLD)) is not None:
            self._weight = focused(self._config.initial.focus, rates, self._group)

    def episode_records(self, variant: Tensor, kind: Tensor) -> dict[str, Tensor]:
        """`piece_carry` [k]: the group of the box by weight; NaN for reference states, whose boxes
        are of the clips' sizes."""
        if not self._config.initial.focus:
            return {}
        return {_TOLD: torch.where(kind != 0, self._group[variant].float(), torch.nan)}

    def draw(self, scenes: Tensor, episodes: Tensor) -> BoxInitialStates:
        """Initial states for scene ids [m] and episode numbers [m] (int64 both)."""
        u = random_streams.uniform(self._seed, random_streams.EPISODE, scenes, episodes, 16)
        drawn = self._put_down_more(self._character.draw(u), u[:, 14])
        from_clip, box = drawn.kind == 0, self._library.box
        variant = chosen(self._weight, len(self._bank), u[:, 4])
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
            bent = grasp.holding_pose(qpos, _box(self._bank.target(variant, layout)))
            qpos = torch.where(in_hand[:, None], bent, qpos)
        return BoxInitialStates(qpos, qvel, variant, drawn.kind, drawn.named_frame(), layout)

    def target(self, states: BoxInitialStates) -> Target:
        """Targets of the boxes of `states`."""
        return self._bank.target(states.variant, states.layout)

    def apply(self, scenes: Scenes, ids: Tensor, states: BoxInitialStates) -> None:
        """Write `states` into the scenes `ids` [m], which have their models already."""
        layout = states.layout
        scenes.set_state(ids, states.qpos, states.qvel, layout.start, layout.start_yaw)
        self._bank.apply(scenes, ids, states.variant, layout)

    def load_n(self, states: BoxInitialStates) -> tuple[Tensor, Tensor]:
        """Force of each hand on the box, and weight of the box, N: [m] each; 0 where it is not in
        hand."""
        box = self._library.box
        held = torch.zeros_like(states.frame, dtype=torch.bool)
        if box is not None:
            held = (states.kind == 0) & (states.frame >= 0) & box.held[states.frame]
        weight = torch.where(held, self._bank.mass[states.variant] * _GRAVITY_M_S2, 0.0)
        return _GRIP * weight / (2.0 * FRICTION) + torch.where(held, _GRIP_N, 0.0), weight

    def _put_down_more(self, drawn: CharacterStates, u: Tensor) -> CharacterStates:
        """The states, some of those with the box in hand redrawn from frames in which it is put
        down; u [m]: uniform numbers."""
        box, fraction, pool = self._library.box, self._config.carry.putting_down, self._late
        if box is None or not fraction or not len(pool):
            return drawn
        again = (drawn.kind == 0) & box.held[drawn.frame] & (u < fraction)
        number = (u.double() / fraction * len(pool)).long().clamp_max(len(pool) - 1)
        frame = torch.where(again, pool[number], drawn.frame)
        frames = self._library.at(frame)
        return replace(
            drawn,
            frame=frame,
            frames=frames,
            qpos=torch.where(again[:, None], frames.qpos, drawn.qpos),
            qvel=torch.where(again[:, None], frames.qvel, drawn.qvel),
        )

    def _on_stands(self, drawn: CharacterStates, variant: Tensor, u: Tensor) -> Layout:
        """Layouts with the boxes on stands about the characters: near or far, at any bearing and
        yaw, or before them with a long side towards them."""
        initial, half, kind = self._config.initial, self._bank.half[variant], drawn.kind
        low = torch.where(kind == 1, initial.near_m[0], initial.far_m[0])
        high = torch.where(kind == 1, initial.near_m[1], initial.far_m[1])
        distance = low + (high - low) * u[:, 5]
        distance = distance.maximum(half[:, :2].norm(dim=1) + _CLEAR_M)
        onwards = rotations.turn(course(drawn.qpos, drawn.qvel), unit((u[:, 6] - 0.5) / 4))
        ahead = (kind == 2) & (u[:, 8] < initial.ahead_fraction)
        before = (kind == 1) & (u[:, 8] < initial.front_fraction)
        bearing = torch.where((ahead | before)[:, None], onwards, unit(u[:, 6]))
        here = distance[:, None] * bearing
        start = torch.cat((here, self._rest_height(half, u[:, 9])), dim=1)
        target = self._target(start, half, u[:, 10:13])
        # whole and half turns of the two long sides, and what is left of u as a small angle
        side, left = (2.0 * u[:, 7]).floor(), (2.0 * u[:, 7]) % 1.0
        squared = rotations.turn(bearing, unit(0.5 * side + (left - 0.5) * _SQUARED_TURN))
        yaw = torch.where(before[:, None], squared, unit(u[:, 7]))
        lifted = start + start.new_tensor((0.0, 0.0, _BOX_LIFT_M))
        return Layout(
            lifted, rotations.from_heading(yaw), start.new_zeros(len(start), 6), start, yaw, target
        )

    def _rest_height(self, half: Tensor, u: Tensor) -> Tensor:
        """[m, 1]: height of a box's centre on a stand, m."""
        low, high = self._config.carry.stand_m
        return half[:, 2:] + (low + (high - low) * u)[:, None]

    def _target(self, start: Tensor, half: Tensor, u: Tensor) -> Tensor:
        """[m, 3]: targets at any bearing from the box, clear of the character, m."""
        low, high = self._config.carry.target_m
        offset = (low + (high - low) * u[:, :1]) * unit(u[:, 1])
        there = start[:, :2] + offset
        blocked = there.norm(dim=1) < _TARGET_CLEAR_M
        # the mirrored point is clear, since the box is away from the character
        there = torch.where(blocked[:, None], start[:, :2] - offset, there)
        return torch.cat((there, self._rest_height(half, u[:, 2])), dim=1)

    def _ahead(self, heading: Tensor, half: Tensor, u: Tensor) -> Tensor:
        """[m, 3]: targets of a box in hand, ahead of the character, some of them near, m."""
        carry = self._config.carry
        reach = u[:, 13] < carry.near_target
        low = torch.where(reach, carry.near_target_m[0], carry.target_m[0])
        high = torch.where(reach, carry.near_target_m[1], carry.target_m[1])
        spread = torch.where(reach, 1.0 / 9.0, 0.5)
        bearing = rotations.turn(heading, unit((u[:, 11] - 0.5) * spread))
        ahead = (low + (high - low) * u[:, 10])[:, None] * bearing
        return torch.cat((ahead, self._rest_height(half, u[:, 12])), dim=1)

    def _in_hand(self, qpos: Tensor, qvel: Tensor, half: Tensor, u: Tensor) -> Layout:
        """Layouts with the boxes in hand, moving with upright characters; the initial stands are
        far behind them."""
        heading = rotations.heading(qpos[:, 3:7])
        position = grasp.held_centre(qpos[:, :3], heading, half[:, 0])
        # a larger box with its underside where the default one's is: arms do not reach lower
        position[:, 2] += (half[:, 2] - _DEFAULT_HALF_M).clamp_min(0.0)
        behind = torch.cat((-_AWAY_M * heading, self._rest_height(half, u[:, 9])), dim=1)
        velocity = torch.cat((qvel[:, :3], torch.zeros_like(qvel[:, :3])), dim=1)
        rotation = rotations.from_heading(heading)
        return Layout(position, rotation, velocity, behind, heading, self._ahead(heading, half, u))

    def _from_clips(
        self, drawn: CharacterStates, box: BoxFrames, variant: Tensor, u: Tensor
    ) -> Layout:
        """Layouts of the clips' frames; what a clip does not show is drawn."""
        half, frame, held = self._bank.half[variant], drawn.frame, drawn.stage == CONTACT
        root = drawn.frames.qpos[:, :3]
        origin = torch.cat((root[:, :2], torch.zeros_like(root[:, :1])), dim=1)
        position = box.position[frame] - origin
        picked = box.picked[frame, :3] - origin
        yaw = torch.stack((box.picked[frame, 3].cos(), box.picked[frame, 3].sin()), dim=1)
        put = box.put[frame, :3] - origin
        putting, from_start = _putting(box, frame)
        # a stand that the clip does not show, or that the box has left, is moved away
        unknown = ~box.has_picked[frame] | (putting & (from_start < 1.0))
        middle = torch.zeros_like(root[:, :2])
        picked = stands_away(picked, middle, box.held[frame])
        put = stands_away(put, middle, box.held[frame])
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


def _putting(box: BoxFrames, frame: Tensor) -> tuple[Tensor, Tensor]:
    """[m] bool: the clip puts its box down in these frames [m]; [m]: horizontal distance of the box
    from where it was picked up, m."""
    position = box.position[frame]
    from_start = (position - box.picked[frame, :3])[:, :2].norm(dim=1)
    found = box.has_put[frame] & ((position - box.put[frame, :3])[:, :2].norm(dim=1) < _PUTTING_M)
    return found & (~box.has_picked[frame] | (from_start > _PUTTING_M)), from_start


def _box(target: Target) -> BoxState:
    assert target.box is not None, "the targets of a bank of boxes have boxes"
    return target.box


def _where(condition: Tensor, yes: Layout, no: Layout) -> Layout:
    """Rows of `yes` where condition [m] holds, of `no` elsewhere."""
    return Layout(
        *(
            torch.where(condition[:, None], getattr(yes, name), getattr(no, name))
            for name in Layout.__dataclass_fields__
        )
    )
