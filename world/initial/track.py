"""How an episode of following a clip starts: anywhere in any clip, with what the clip uses.

An initial state is a pure function of (seed, scene, episode).
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, rotations
from world.config import WorldConfig
from world.errors import ConfigError
from world.initial.reference import LIFT_M
from world.motions.reference import drawn
from world.objects.track_bank import TrackBank
from world.scene.batch import Scenes
from world.tasks.task import BoxState
from world.tasks.track import TrackPlace

#: A box that no one uses rests on a stand here, m from the start.
_PARKED_M = (-50.0, 5.0, 0.5)
#: How far above its stand a box is set down, m: contacts start unloaded.
_BOX_LIFT_M = 0.001


@dataclass(frozen=True)
class TrackStarts:
    """First states of m episodes, the character above the origin."""

    qpos: Tensor
    """[m, 43]."""
    qvel: Tensor
    """[m, 34]."""
    variant: Tensor
    """[m] int64: clip and box, by number in the bank."""
    kind: Tensor
    """[m] int64: index into world.initial.reference.KINDS: all from clips."""
    frame: Tensor
    """[m] int64: of the reference."""
    origin: Tensor
    """[m, 3]: from the clips' worlds to the scenes', m."""


class TrackStarter:
    """Draws the initial states of a shard's episodes."""

    def __init__(self, config: WorldConfig, bank: TrackBank, seed: int) -> None:
        self._bank, self._reference, self._seed = bank, bank.reference, seed
        self._residual, self._focus = config.track.residual, config.track.focus
        if not 0.0 <= self._focus <= 1.0:
            raise ConfigError(f"track.focus {self._focus}: choose a share from 0 to 1")
        self._weight = self._reference.start_weight

    def heed(self, failures: Tensor) -> None:
        """Start more episodes where, and shortly before where, they failed; failures [S]: recent
        ones by segment."""
        harder = self._reference.harder(failures)
        mixed = 1.0 - self._focus + self._focus * harder
        self._weight = self._reference.start_weight * mixed

    def draw(self, scenes: Tensor, episodes: Tensor) -> TrackStarts:
        """The initial states of the given scene ids [m] and episode numbers [m] (int64 both)."""
        u = random_streams.uniform(self._seed, random_streams.EPISODE, scenes, episodes, 2)
        return self.at(drawn(self._weight, u[:, 0]), u[:, 1])

    def at(self, frame: Tensor, u: Tensor) -> TrackStarts:
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
        return TrackStarts(qpos, qvel, variant, kind, frame, origin)

    def place(self, starts: TrackStarts) -> TrackPlace:
        """What the task knows of the scenes of `starts`."""
        bank, reference = self._bank, self._reference
        clip = reference.clip[starts.frame]
        yaw, origin = bank.yaw[clip], bank.origin[clip] + starts.origin
        corners = rotations.turn(yaw[:, None], bank.corners[clip]) + origin[:, None]
        box = None
        if bank.has_box:
            pose, velocity = self._box(starts)
            half = bank.half[starts.variant]
            box = BoxState(
                pose[:, :3],
                pose[:, 3:],
                velocity[:, :3],
                half,
                reference.picked[clip, :3] + starts.origin,
                reference.put[clip, :3] + starts.origin,
            )
            corners = box.corners()
        return TrackPlace(
            bank.point[clip] + starts.origin,
            yaw,
            corners,
            bank.head[clip] + starts.origin,
            box,
            reference=reference,
            residual=self._residual,
            frame=starts.frame.clone(),
            origin=starts.origin.clone(),
            lost=torch.zeros_like(starts.frame),
            mass=bank.mass[starts.variant],
        )

    def put(self, scenes: Scenes, ids: Tensor, starts: TrackStarts) -> None:
        """Set the scenes `ids` [m] up as `starts` has them; their models are there already."""
        bank, reference = self._bank, self._reference
        clip = reference.clip[starts.frame]
        origin, yaw = bank.origin[clip] + starts.origin, bank.yaw[clip]
        if not bank.has_box:
            scenes.set_down(ids, starts.qpos, starts.qvel, origin, yaw)
            return
        half = bank.half[starts.variant, 2:]
        picks = (reference.boxed & reference.has_picked)[clip][:, None]
        picked = reference.picked[clip]
        top = torch.cat((picked[:, :2], picked[:, 2:3] - half), dim=1) + starts.origin
        angle = picked[:, 3]
        turned = torch.stack((torch.cos(angle), torch.sin(angle)), dim=1)
        origin, yaw = torch.where(picks, top, origin), torch.where(picks, turned, yaw)
        scenes.set_down(ids, starts.qpos, starts.qvel, origin, yaw)
        puts = (reference.boxed & reference.has_put)[clip][:, None]
        there = reference.put[clip, :3] + starts.origin
        down = torch.cat((torch.zeros_like(half), torch.zeros_like(half), half), dim=1)
        parked = there.new_tensor(_PARKED_M).expand_as(there)
        scenes.move_stand(ids, torch.where(puts, there, parked) - down)
        pose, velocity = self._box(starts)
        scenes.set_free(ids, 0, pose, velocity)

    def load_n(self, starts: TrackStarts) -> tuple[Tensor, Tensor]:
        """What each hand presses on the box with, and what the box weighs, N: [m] each; the
        reference's set-points have that already."""
        nothing = torch.zeros(len(starts.frame))
        return nothing, nothing

    def _box(self, starts: TrackStarts) -> tuple[Tensor, Tensor]:
        """Pose [m, 7] and velocity [m, 6] of the boxes; parked where the clip has none."""
        reference = self._reference
        boxed = reference.boxed[reference.clip[starts.frame]][:, None]
        pose = reference.box[starts.frame].clone()
        lift = torch.where(reference.held[starts.frame], LIFT_M, _BOX_LIFT_M)
        pose[:, :3] += starts.origin
        pose[:, 2] += lift
        parked = pose.new_tensor((*_PARKED_M[:2], _PARKED_M[2] + _BOX_LIFT_M, 1.0, 0.0, 0.0, 0.0))
        velocity = reference.box_velocity[starts.frame]
        zero = torch.zeros_like(velocity)
        return torch.where(boxed, pose, parked), torch.where(boxed, velocity, zero)
