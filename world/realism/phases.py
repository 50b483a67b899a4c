"""The phases of a motion: approach, transition, contact.

The phases of simulation and mocap are found in the same way, from the motion and the object that it
uses (`world.motions.segments`).
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import torch

from world import rotations
from world.motions import segments
from world.motions.clip import Clip
from world.realism.measures import Motion

ALL, APPROACH, TRANSITION, CONTACT = "all", "approach", "transition", "contact"
PHASES = (ALL, APPROACH, TRANSITION, CONTACT)
#: Phase of each stage of `segments`: walking off counts as approach.
_PHASE = {
    segments.APPROACH: APPROACH,
    segments.TRANSITION: TRANSITION,
    segments.CONTACT: CONTACT,
    segments.LEAVE: APPROACH,
}


def noised(clips: Sequence[Clip], deviation_rad: float, seed: int = 0) -> list[Clip]:
    """Return `clips` with independent Gaussian noise on every local rotation in every frame."""
    generator = np.random.default_rng(seed)
    found = []
    for clip in clips:
        shape = (*clip.local_rotation.shape[:2], 3)
        noise = torch.from_numpy(generator.normal(0.0, deviation_rad, shape).astype(np.float32))
        turned = rotations.multiply(
            torch.from_numpy(clip.local_rotation), rotations.from_rotation_vector(noise)
        )
        found.append(replace(clip, local_rotation=turned.numpy()))
    return found


def by_phase(clips: Sequence[Clip]) -> tuple[dict[str, list[Motion]], dict[str, list[int]]]:
    """Return the contiguous stretches of each phase of `clips`, and the clip that each is of."""
    motions: dict[str, list[Motion]] = {phase: [] for phase in PHASES}
    owner: dict[str, list[int]] = {phase: [] for phase in PHASES}
    for number, clip in enumerate(clips):
        qpos, qvel = torch.from_numpy(clip.qpos()), torch.from_numpy(clip.qvel())
        stage = segments.stages(clip)
        phase = np.array([_PHASE[int(one)] for one in stage])
        edges = [0, *(np.flatnonzero(phase[1:] != phase[:-1]) + 1), len(phase)]
        spans = [(ALL, 0, len(phase))]
        spans += [(str(phase[a]), int(a), int(b)) for a, b in pairwise(edges)]
        for name, start, stop in spans:
            motions[name].append(Motion(qpos[start:stop], qvel[start:stop]))
            owner[name].append(number)
    return motions, owner
