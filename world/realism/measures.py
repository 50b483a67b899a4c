"""Measures of the realism of a motion, the same for simulation and mocap.

Trajectories are qpos [T, 43] and qvel [T, 34] at the control rate, float32 or float64.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from world import rotations
from world.character import features, kinematics, soles
from world.character import model as character

#: Frames of one window of the spectrum, about two seconds; windows overlap by half.
WINDOW = 64
#: Joint motion of people is below this frequency, tremor of servos above it, Hz.
TREMOR_HZ = 5.0


@dataclass(frozen=True)
class Motion:
    """One trajectory."""

    qpos: Tensor
    """[T, 43]."""
    qvel: Tensor
    """[T, 34]."""


@dataclass(frozen=True)
class Figures:
    """Measures of a set of trajectories."""

    foot_skate_m_s: float
    """Mean horizontal speed of the corners of soles that stand on the floor."""
    jerk_m_s3: float
    """Mean magnitude of the third derivative of the bodies' positions: over bodies and time."""
    jerk_p95_m_s3: float
    """95th percentile over time of the mean over bodies."""
    joint_speed_rad_s: float
    """Root mean square of the joint velocities over joints and time."""
    tremor_share: float | None
    """Fraction of the power of joint velocities above TREMOR_HZ; None where no trajectory is as
    long as a WINDOW."""
    seconds: float
    """Total duration."""


def measure(motions: Sequence[Motion], hz: float = character.CONTROL_HZ) -> Figures:
    """The measures of trajectories of at least 4 frames each; shorter ones are left out."""
    motions = [motion for motion in motions if len(motion.qpos) >= 4]
    skates = [skating(motion.qpos, hz) for motion in motions]
    moved, planted = (sum(part[i] for part in skates) for i in (0, 1))
    each = [jerk(positions(m.qpos), hz).numpy() for m in motions]
    jerks = np.concatenate(each or [np.zeros((0, 15))])
    frequency, power = spectrum(motions, hz)
    total = float(power.sum())
    joints = [motion.qvel[:, 6:].double().square().mean(1) for motion in motions]
    return Figures(
        foot_skate_m_s=moved / planted if planted else 0.0,
        jerk_m_s3=float(jerks.mean()) if len(jerks) else 0.0,
        jerk_p95_m_s3=float(np.percentile(jerks.mean(1), 95)) if len(jerks) else 0.0,
        joint_speed_rad_s=float(torch.cat(joints).mean().sqrt()) if joints else 0.0,
        tremor_share=float(power[frequency > TREMOR_HZ].sum()) / total if total else None,
        seconds=sum(len(motion.qpos) for motion in motions) / hz,
    )


def poses(qpos: Tensor) -> tuple[Tensor, Tensor]:
    """World positions [T, 15, 3] m and rotation matrices [T, 15, 3, 3] of the bodies."""
    qpos = qpos.double()
    local = rotations.matrix(kinematics.local_rotations(qpos))
    return kinematics.forward(qpos[:, :3], local)


def positions(qpos: Tensor) -> Tensor:
    """World positions of the bodies [T, 15, 3], m."""
    return poses(qpos)[0]


def skating(qpos: Tensor, hz: float) -> tuple[float, int]:
    """Summed horizontal speed, m/s, of sole corners while they stand on the floor, and the number
    of pairs of frames and corners in the sum."""
    corners = sole_corners(qpos)
    speed, planted = soles.slips(corners[:-1], corners[1:], hz)
    return float(speed[planted].sum()), int(planted.sum())


def sole_corners(qpos: Tensor) -> Tensor:
    """World positions of the corners of the soles [T, 2, 4, 3], right foot first, m."""
    position, rotation = poses(qpos)
    return soles.corners(position[:, soles.FEET], rotation[:, soles.FEET])


def jerk(position: Tensor, hz: float) -> Tensor:
    """Magnitude of the third derivative [T - 3, ..] m/s^3 of positions [T, .., 3], by
    differences."""
    third = position[3:] - 3 * position[2:-1] + 3 * position[1:-2] - position[:-3]
    return third.norm(dim=-1) * hz**3


def spectrum(
    motions: Sequence[Motion], hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """One-sided power spectral density of the joint velocities, mean over the 28 (Welch's method).

    Hann windows of WINDOW frames that overlap by half, each less its mean: frequencies [WINDOW/2 +
    1] Hz and power [(rad/s)^2/Hz]; trajectories shorter than a window are left out (all: power 0).
    """
    hann = np.hanning(WINDOW + 1)[:-1]
    frequency = np.asarray(np.fft.rfftfreq(WINDOW, 1.0 / hz), np.float64)
    power, windows = np.zeros(len(frequency)), 0
    for motion in motions:
        velocity = motion.qvel[:, 6:].double().numpy()
        for start in range(0, len(velocity) - WINDOW + 1, WINDOW // 2):
            part = velocity[start : start + WINDOW]
            spectral = np.fft.rfft((part - part.mean(0)) * hann[:, None], axis=0)
            power += (np.abs(spectral) ** 2).mean(1)
            windows += 1
    scale = 2.0 / (hz * (hann**2).sum() * max(windows, 1))
    power *= scale
    power[[0, -1]] /= 2
    return frequency, power


def spectrum_windows(motions: Sequence[Motion]) -> int:
    """Return the number of windows that `spectrum` averages."""
    return sum(len(range(0, len(m.qvel) - WINDOW + 1, WINDOW // 2)) for m in motions)


def spectral_distance_db(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
    """Root mean square of the ratio in dB of two densities [F], the mean (index 0) left out."""
    tiny = 1e-9
    ratio = 10 * np.log10((ours[1:] + tiny) / (theirs[1:] + tiny))
    return float(np.sqrt(np.mean(ratio**2)))


def transitions(motion: Motion) -> Tensor:
    """The character's features of consecutive frames [T - 1, 210], without the object's."""
    own = features.body(motion.qpos.float(), motion.qvel.float()).features
    return torch.cat((own[:-1], own[1:]), dim=1)


def nearest(
    query: Tensor, reference: Tensor, same: tuple[Tensor, Tensor] | None = None, rows: int = 256
) -> Tensor:
    """Distance [n] from rows query [n, F] to the nearest of reference [m, F], as the root mean
    square over the F.

    same: labels [n] and [m] int64; rows of the same label do not count (a clip against itself).
    """
    found = []
    for start in range(0, len(query), rows):
        part = query[start : start + rows]
        distance = torch.cdist(part, reference)
        if same is not None:
            mine = same[0][start : start + rows]
            distance[mine[:, None] == same[1][None]] = torch.inf
        found.append(distance.min(dim=1).values)
    return torch.cat(found) / query.shape[1] ** 0.5 if found else query.new_zeros(0)
