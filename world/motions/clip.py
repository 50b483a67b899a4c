"""A motion clip of the character, in the simulator's coordinates, with the objects that it uses."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
import torch

from world import rotations
from world.character import model as character
from world.errors import ClipError
from world.motions.objects import Bed, BoxTrack, Seat, Skeleton

SeatOrBed = TypeVar("SeatOrBed", Seat, Bed)


@dataclass(frozen=True)
class Clip:
    """A motion clip: T frames at `fps`, body frames x forward, y left, z up, floor at z = 0."""

    name: str
    fps: int
    root_position_m: np.ndarray
    """[T, 3] float32, world."""
    local_rotation: np.ndarray
    """[T, 15, 4] float32 w, x, y, z: each body's rotation in its parent's frame, the root's in the
    world."""
    source: str
    licence: str
    seat: Seat | None = None
    bed: Bed | None = None
    box: BoxTrack | None = None
    ghost: Skeleton | None = None
    """The recorded skeleton of a retargeted clip."""

    @property
    def frames(self) -> int:
        return self.root_position_m.shape[0]

    @property
    def seconds(self) -> float:
        return self.frames / self.fps

    def qpos(self) -> np.ndarray:
        """Generalised coordinates [T, 43] float32; hinges take the twist about their axis.

        Quaternions are continuous in time (no sign flips).
        """
        return generalised_positions(self.root_position_m, self.local_rotation)

    def qvel(self) -> np.ndarray:
        """Generalised velocities [T, 34] float32 in MuJoCo's frames, by central differences."""
        return generalised_velocities(self.qpos(), self.fps)

    def part(self, start: int, stop: int) -> "Clip":
        """The frames from `start` to one before `stop`, with their objects.

        A seat or bed that is used outside is left out; a use across the cut ends there.
        """

        def cut(thing: SeatOrBed) -> SeatOrBed | None:
            first, last = max(thing.from_frame, start), min(thing.to_frame, stop)
            return (
                None
                if first >= last
                else replace(thing, from_frame=first - start, to_frame=last - start)
            )

        return replace(
            self,
            root_position_m=self.root_position_m[start:stop],
            local_rotation=self.local_rotation[start:stop],
            seat=cut(self.seat) if self.seat else None,
            bed=cut(self.bed) if self.bed else None,
            box=self.box.part(start, stop) if self.box else None,
            ghost=self.ghost.part(start, stop) if self.ghost else None,
        )


def validate(clip: Clip) -> Clip:
    """Return the clip itself. Raises ClipError if it does not fit the character."""
    shape = clip.local_rotation.shape
    if clip.root_position_m.ndim != 2 or clip.root_position_m.shape[1:] != (3,):
        raise ClipError(
            f"{clip.name}: root_position_m must be [T, 3], is {clip.root_position_m.shape}"
        )
    if shape != (clip.frames, 15, 4):
        raise ClipError(
            f"{clip.name}: local_rotation must be [{clip.frames}, 15, 4] for the character's"
            f" 15 bodies, is {list(shape)}"
        )
    if clip.frames < 2:
        raise ClipError(f"{clip.name}: {clip.frames} frame(s); a transition needs at least 2")
    if not (np.isfinite(clip.root_position_m).all() and np.isfinite(clip.local_rotation).all()):
        raise ClipError(f"{clip.name}: holds non-finite values")
    length = np.linalg.norm(clip.local_rotation, axis=-1)
    if np.abs(length - 1).max() > 1e-2:
        raise ClipError(f"{clip.name}: rotations are not unit quaternions (w, x, y, z)")
    _check_objects(clip)
    return clip


def _check_objects(clip: Clip) -> None:
    """Raise ClipError where a clip's objects or ghost do not fit its frames."""
    box, ghost = clip.box, clip.ghost
    if box is not None:
        if box.pose.shape != (clip.frames, 7):
            raise ClipError(
                f"{clip.name}: the box's pose must be [{clip.frames}, 7], is {box.pose.shape}"
            )
        if box.held.shape != (clip.frames,):
            raise ClipError(
                f"{clip.name}: the box's held must be [{clip.frames}], is {box.held.shape}"
            )
        if not (np.isfinite(box.pose).all() and all(0 < edge < 10 for edge in box.size_m)):
            raise ClipError(
                f"{clip.name}: the box's pose and size must be finite, its edges below 10 m"
            )
    for word, thing in (("seat", clip.seat), ("bed", clip.bed)):
        if thing is None:
            continue
        first, last = thing.from_frame, thing.to_frame
        if not (type(first) is int and type(last) is int and 0 <= first < last <= clip.frames):
            raise ClipError(
                f"{clip.name}: the {word}'s frames must be within 0 to {clip.frames}, are"
                f" {str(first)[:20]} to {str(last)[:20]}"
            )
        points = (thing.point_m,) if isinstance(thing, Seat) else (thing.hip_m, thing.head_m)
        flat = [*(x for point in points for x in point), thing.facing_rad]
        if any(len(point) != 3 for point in points) or not all(_finite(x) for x in flat):
            raise ClipError(
                f"{clip.name}: the {word}'s place must be three finite lengths and a yaw"
            )
    if ghost is not None:
        joints = len(ghost.names)
        if ghost.position_m.shape != (clip.frames, joints, 3) or len(ghost.parents) != joints:
            raise ClipError(
                f"{clip.name}: the ghost must be [{clip.frames}, {joints}, 3], is"
                f" {list(ghost.position_m.shape)}"
            )
        if not all(-1 <= parent < index for index, parent in enumerate(ghost.parents)):
            raise ClipError(f"{clip.name}: the ghost's parents must stand before their children")
        if not np.isfinite(ghost.position_m).all():
            raise ClipError(f"{clip.name}: the ghost holds non-finite values")


def _finite(value: object) -> bool:
    return isinstance(value, int | float) and bool(np.isfinite(value))


def hinge_angles(local_rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Flexion [T, 4] rad of the hinges (elbow, elbow, knee, knee), and the rotation [T, 4] rad that
    is not about their axes."""
    bodies = [
        b for b, j in zip(character.JOINT_BODIES, character.JOINTS, strict=True) if not j.is_ball
    ]
    q = local_rotation[:, bodies].astype(np.float64)
    twist = 2 * np.arctan2(q[..., 2], q[..., 0])
    twist = (twist + np.pi) % (2 * np.pi) - np.pi
    swing = 2 * np.arcsin(np.clip(np.hypot(q[..., 1], q[..., 3]), 0, 1))
    return twist * np.array(character.HINGE_SIGN), swing


def generalised_positions(root_position_m: np.ndarray, local_rotation: np.ndarray) -> np.ndarray:
    """MuJoCo's qpos [T, 43] float32 of root positions [T, 3] and local rotations [T, 15, 4]."""
    frames = root_position_m.shape[0]
    q = np.empty((frames, character.NQ), np.float64)
    q[:, :3] = root_position_m
    q[:, 3:7] = continuous(local_rotation[:, 0])
    flexion, _ = hinge_angles(local_rotation)
    hinge = 0
    address = 7
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        if joint.is_ball:
            q[:, address : address + 4] = continuous(local_rotation[:, body])
            address += 4
        else:
            q[:, address] = flexion[:, hinge]
            hinge, address = hinge + 1, address + 1
    return q.astype(np.float32)


def continuous(q: np.ndarray) -> np.ndarray:
    """Unit quaternions [T, 4] float64 without sign flips from frame to frame; the first has w >=
    0."""
    q = q.astype(np.float64) / np.linalg.norm(q, axis=-1, keepdims=True)
    sign = np.sign(np.sum(q[1:] * q[:-1], axis=-1))
    sign[sign == 0] = 1
    first = -1.0 if q[0, 0] < 0 else 1.0
    return q * np.concatenate(([first], first * np.cumprod(sign)))[:, None]


def continuous_bodies(local_rotation: np.ndarray) -> np.ndarray:
    """Rotations [T, B, 4] float64 of several bodies, each as `continuous` has it."""
    bodies = range(local_rotation.shape[1])
    return np.stack([continuous(local_rotation[:, body]) for body in bodies], axis=1)


def generalised_velocities(qpos: np.ndarray, fps: float) -> np.ndarray:
    """qvel [T, 34] float32 of qpos [T, 43]: central differences, one-sided at both ends.

    As in the simulator, the root's linear velocity is in world axes, angular velocities are in each
    body's own axes.
    """
    q = torch.as_tensor(qpos, dtype=torch.float64)
    frames = q.shape[0]
    step = torch.empty(frames - 1, character.NV, dtype=torch.float64)
    step[:, :3] = q[1:, :3] - q[:-1, :3]

    def angular(address: int) -> torch.Tensor:
        turned = rotations.multiply(
            rotations.conjugate(q[:-1, address : address + 4]), q[1:, address : address + 4]
        )
        return rotations.to_rotation_vector(turned)

    step[:, 3:6] = angular(3)
    for address, dof in zip(character.BALL_QPOS, character.BALL_DOF, strict=True):
        step[:, dof : dof + 3] = angular(address)
    for address, dof in zip(character.HINGE_QPOS, character.HINGE_DOF, strict=True):
        step[:, dof] = q[1:, address] - q[:-1, address]
    velocity = torch.empty(frames, character.NV, dtype=torch.float64)
    velocity[0], velocity[-1] = step[0], step[-1]
    velocity[1:-1] = 0.5 * (step[1:] + step[:-1])
    return (velocity * fps).to(torch.float32).numpy()


def mirrored(clip: Clip) -> Clip:
    """The clip reflected left to right (y -> −y), with its objects."""
    position = clip.root_position_m * np.array([1, -1, 1], np.float32)
    swapped = clip.local_rotation[:, list(character.MIRROR_BODIES)]
    rotation = swapped * np.array([1, -1, 1, -1], np.float32)
    return replace(
        clip,
        name=f"{clip.name}~mirrored",
        root_position_m=position,
        local_rotation=rotation,
        seat=clip.seat.mirrored() if clip.seat else None,
        bed=clip.bed.mirrored() if clip.bed else None,
        box=clip.box.mirrored() if clip.box else None,
        ghost=clip.ghost.mirrored() if clip.ghost else None,
    )
