"""Initial states of tracking: any sound frame of any clip, with the object of the clip.

An initial state is a pure function of (seed, scene, episode).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.errors import ConfigError
from world.initial.reference import LIFT_M
from world.scene.batch import Scenes
from world.scene.target import BoxState
from world.tracking.arrivals import Arrivals, PickUps
from world.tracking.bank import TrackBank
from world.tracking.reference import Reference
from world.tracking.rollouts import Rollouts, keys
from world.tracking.target import HANDS, TrackTarget

#: Initial position of an unused box, on its stand, m.
_PARKED_M = (-50.0, 5.0, 0.5)
#: Distance of the target from where a clip ends with the box in hand, m.
_ONWARDS_M = 2.0
#: Initial height of a box above its stand, m: contacts are unloaded.
_BOX_LIFT_M = 0.001
#: Hands are free of a box from so far beyond its half diagonal on, m; a displacement is within this
#: angle of straight away from it, rad.
_CLEAR_M, _ASIDE_RAD = 0.15, 1.8


@dataclass(frozen=True)
class TrackInitialStates:
    """Initial states of m episodes, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: clip and box, by number in the bank."""
    kind: Tensor
    """[m] int64: index into world.initial.reference.KINDS: 0, reference states."""
    frame: Tensor
    """[m] int64: of the reference."""
    origin: Tensor
    """[m, 3]: from the clips' worlds to the scenes', m."""
    box: Tensor
    """[m, 7]: pose of the box, parked where the clip has none."""
    box_velocity: Tensor
    """[m, 6]: world m/s, own axes rad/s."""


class TrackSampler:
    """Draws the initial states of tracking; an AdaptiveSampler."""

    def __init__(self, config: WorldConfig, bank: TrackBank, seed: int) -> None:
        self._bank, self._reference, self._seed = bank, bank.reference, seed
        # a set-point of the reference would tell the policy what it is not shown
        self._residual = config.track.residual and not config.track.goal
        self._focus, self._displaced_m = config.track.focus, config.track.displaced_m
        if not 0.0 <= self._focus <= 1.0:
            raise ConfigError(f"track.focus {self._focus}: choose a fraction from 0 to 1")
        self._weight = self._reference.start_weight
        self._aim = _aims(self._reference)
        self._pick_ups = None if bank.arrivals is None else PickUps.of(self._reference)

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Draw more states in, and shortly before, the segments of recent `failures` [S]."""
        if "failures" not in published:
            return
        harder = self._reference.harder(published["failures"])
        mixed = 1.0 - self._focus + self._focus * harder
        self._weight = self._reference.start_weight * mixed

    def episode_records(self, variant: Tensor, kind: Tensor) -> dict[str, Tensor]:
        """Nothing: the target records the segment."""
        return {}

    def draw(self, scenes: Tensor, episodes: Tensor) -> TrackInitialStates:
        """The initial states of the given scene ids [m] and episode numbers [m] (int64 both)."""
        arrivals, rollouts = self._bank.arrivals, self._bank.rollouts
        count = 10 if arrivals is not None else 5 if self._displaced_m else 2
        count = count if rollouts is None else 12
        u = random_streams.uniform(self._seed, random_streams.EPISODE, scenes, episodes, count)
        states = self.at(random_streams.drawn(self._weight, u[:, 0]), u[:, 1])
        if rollouts is not None:
            states = self._simulated(states, rollouts, u[:, 10:])
        if self._displaced_m:
            states = self._displaced(states, u[:, 2:5])
        return states if arrivals is None else self._arrived(states, arrivals, u[:, 5:10])

    def _simulated(
        self, states: TrackInitialStates, rollouts: Rollouts, u: Tensor
    ) -> TrackInitialStates:
        """The states [m], some in place of the reference's as a tracker came by: u [m, 2]."""
        key = keys(states.frame, states.variant, self._bank.each)
        rows, number = rollouts.replaced(key, u)
        qpos, box = rollouts.qpos[number].clone(), rollouts.box[number].clone()
        for pose in (qpos, box):
            pose[:, :3] += states.origin[rows]
        boxed = self._reference.boxed[self._reference.clip[states.frame[rows]]][:, None]
        velocity = rollouts.box_velocity[number]
        new = {
            "qpos": qpos,
            "qvel": rollouts.qvel[number],
            "box": torch.where(boxed, box, states.box[rows]),
            "box_velocity": torch.where(boxed, velocity, states.box_velocity[rows]),
        }
        found = {name: getattr(states, name).index_put((rows,), new[name]) for name in new}
        return replace(states, **found)

    def _arrived(
        self, states: TrackInitialStates, arrivals: Arrivals, u: Tensor
    ) -> TrackInitialStates:
        """The states [m], of those shortly before a pick-up from standing some as a walker comes to
        it: u [m, 5] in [0, 1)."""
        pick_ups = self._pick_ups
        assert pick_ups is not None, "arrivals come with the bank"
        clip = self._reference.clip[states.frame]
        rows = pick_ups.chosen(clip, states.frame, u[:, 0])
        clip, u = clip[rows], u[rows]
        frame = pick_ups.frames(clip, self._reference.first[clip], u[:, 1])
        box = states.variant[rows] % self._bank.each
        joined = self.at(frame, (box + 0.5) / self._bank.each)
        come = pick_ups.laid(arrivals, clip, joined.origin, u[:, 2:])
        new = replace(joined, qpos=come.qpos, qvel=come.qvel)
        new.qpos[:, 2] += LIFT_M
        found = {}
        for field in fields(states):
            value = getattr(states, field.name).clone()
            value[rows] = getattr(new, field.name).to(value)
            found[field.name] = value
        return TrackInitialStates(**found)

    def _displaced(self, states: TrackInitialStates, u: Tensor) -> TrackInitialStates:
        """The states [m] moved away from the box, where the hands are free of it; the scene stays:
        u [m, 3] in [0, 1)."""
        reference, frame = self._reference, states.frame
        to_box = reference.box[frame, :2] - reference.position[frame, 0, :2]
        size = reference.size[reference.clip[frame]].norm(dim=1)
        hands = (reference.position[frame][:, HANDS] - reference.box[frame, None, :3]).norm(dim=2)
        free = reference.boxed[reference.clip[frame]] & ~reference.held[frame]
        free &= hands.amin(dim=1) > 0.5 * size + _CLEAR_M
        moved = torch.where(free, self._displaced_m * u[:, 0].sqrt(), 0.0)
        back = -to_box / to_box.norm(dim=1, keepdim=True).clamp_min(1e-6)
        step = moved[:, None] * rotations.turn(
            back, rotations.cos_sin(_ASIDE_RAD * (2.0 * u[:, 1] - 1.0))
        )
        turn = moved * (2.0 * u[:, 2] - 1.0)
        qpos, qvel = states.qpos.clone(), states.qvel.clone()
        # the origin is below the reference: the scene is where it was
        qpos[:, :2] += step
        about = rotations.cos_sin(turn)
        qpos[:, 3:7] = rotations.multiply(rotations.from_heading(about), qpos[:, 3:7])
        qvel[:, :2] = rotations.turn(about, qvel[:, :2])
        return replace(states, qpos=qpos, qvel=qvel)

    def at(self, frame: Tensor, u: Tensor) -> TrackInitialStates:
        """The initial states of reference frames [m]; u [m] in [0, 1) chooses the box."""
        reference, bank = self._reference, self._bank
        choice = (u * bank.each).long().clamp_max(bank.each - 1)
        qpos, qvel = reference.qpos[frame], reference.qvel[frame]
        level = torch.zeros_like(qpos[:, :2])
        origin = torch.cat((-qpos[:, :2], torch.zeros_like(qpos[:, :1])), dim=1)
        qpos = torch.cat(
            (level, qpos[:, 2:3] + LIFT_M + bank.lift[frame, None], qpos[:, 3:]), dim=1
        )
        kind = torch.zeros_like(frame)
        variant = reference.clip[frame] * bank.each + choice
        box, velocity = self._box(frame, origin)
        return TrackInitialStates(qpos, qvel, variant, kind, frame, origin, box, velocity)

    def target(self, states: TrackInitialStates) -> TrackTarget:
        """Targets [m] of `states`."""
        bank, reference = self._bank, self._reference
        clip = reference.clip[states.frame]
        yaw, origin = bank.yaw[clip], bank.origin[clip] + states.origin
        corners = rotations.turn(yaw[:, None], bank.corners[clip]) + origin[:, None]
        box = None
        if bank.has_box:
            half = bank.half[states.variant]
            box = BoxState(
                states.box[:, :3],
                states.box[:, 3:],
                states.box_velocity[:, :3],
                half,
                reference.picked[clip, :3] + states.origin,
                self._aim[clip] + states.origin,
            )
            corners = box.corners()
        return TrackTarget(
            bank.point[clip] + states.origin,
            yaw,
            corners,
            bank.head[clip] + states.origin,
            box,
            reference=reference,
            residual=self._residual,
            frame=states.frame.clone(),
            origin=states.origin.clone(),
            lost=torch.zeros_like(states.frame),
            mass=bank.mass[states.variant],
        )

    def apply(self, scenes: Scenes, ids: Tensor, states: TrackInitialStates) -> None:
        """Write `states` into the scenes `ids` [m], which have their models already."""
        bank, reference = self._bank, self._reference
        clip = reference.clip[states.frame]
        origin, yaw = bank.origin[clip] + states.origin, bank.yaw[clip]
        if not bank.has_box:
            scenes.set_state(ids, states.qpos, states.qvel, origin, yaw)
            return
        half = bank.half[states.variant, 2:]
        picks = (reference.boxed & reference.has_picked)[clip][:, None]
        picked = reference.picked[clip]
        top = torch.cat((picked[:, :2], picked[:, 2:3] - half), dim=1) + states.origin
        angle = picked[:, 3]
        turned = torch.stack((torch.cos(angle), torch.sin(angle)), dim=1)
        origin, yaw = torch.where(picks, top, origin), torch.where(picks, turned, yaw)
        scenes.set_state(ids, states.qpos, states.qvel, origin, yaw)
        puts = (reference.boxed & reference.has_put)[clip][:, None]
        there = reference.put[clip, :3] + states.origin
        down = torch.cat((torch.zeros_like(half), torch.zeros_like(half), half), dim=1)
        parked = there.new_tensor(_PARKED_M).expand_as(there)
        scenes.move_stand(ids, torch.where(puts, there, parked) - down)
        scenes.set_free(ids, 0, states.box, states.box_velocity)

    def load_n(self, states: TrackInitialStates) -> tuple[Tensor, Tensor]:
        """Force of each hand and weight that both bear, N: zeros, [m] each, as the reference's
        set-points contain them."""
        nothing = torch.zeros(len(states.frame))
        return nothing, nothing

    def _box(self, frame: Tensor, origin: Tensor) -> tuple[Tensor, Tensor]:
        """Pose [m, 7] and velocity [m, 6] of the boxes in frames [m], their clips' worlds at origin
        [m, 3]; parked where the clip has none."""
        reference = self._reference
        boxed = reference.boxed[reference.clip[frame]][:, None]
        pose = reference.box[frame].clone()
        lift = torch.where(reference.held[frame], LIFT_M, _BOX_LIFT_M)
        pose[:, :3] += origin
        pose[:, 2] += lift
        parked = pose.new_tensor((*_PARKED_M[:2], _PARKED_M[2] + _BOX_LIFT_M, 1.0, 0.0, 0.0, 0.0))
        velocity = reference.box_velocity[frame]
        zero = torch.zeros_like(velocity)
        return torch.where(boxed, pose, parked), torch.where(boxed, velocity, zero)


def _aims(reference: Reference) -> Tensor:
    """Return the targets [C, 3] of the boxes, m: where they are put down; a clip that ends with the
    box in hand is on its way to a place ahead of it."""
    last = reference.stop - 1
    ahead = torch.cat(
        (reference.heading[last], torch.zeros_like(reference.heading[last, :1])), dim=1
    )
    onwards = reference.box[last, :3] + _ONWARDS_M * ahead
    return torch.where(reference.has_put[:, None], reference.put[:, :3], onwards)
