"""Realism of a set of motions relative to held-out mocap, by phase.

Every figure is measured twice in the same way: of the motions in question, and of held-out mocap
replayed on the character's skeleton. Their ratio is what to read: held-out mocap has 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from world.character import model as character
from world.errors import ClipError
from world.motions.clip import Clip
from world.objects import clearance
from world.realism import comparison, measures, phases, rest, windows
from world.realism.measures import Motion

#: A root that is faster than this walks, m/s.
_WALKS_M_S = 0.3
#: Windows that a spectrum needs, so that it is an average.
_SPECTRA = 24
#: What each measure is, and its unit.
MEASURES: dict[str, tuple[str, str]] = {
    "jerk": ("mean jerk of the bodies", "m/s³"),
    "skating": ("mean speed of sole corners on the floor", "m/s"),
    "penetration": ("mean depth of the body below the floor", "mm"),
    "tremor": ("share of joint power above 5 Hz", ""),
    "walking_speed": ("median speed of the root while it walks", "m/s"),
    "rest": ("share of rest with head, hands or feet elsewhere", ""),
    "spectral_distance": ("distance of joint power spectra", "dB"),
    "frechet": ("Fréchet distance of 0.5 s windows", ""),
    "separability": ("area under the ROC curve of a classifier", ""),
    "coverage": ("share of the reference's windows that are covered", ""),
}


#: Values of the reference that are 0 within the accuracy of a measure, in its unit: a ratio to less
#: would be of noise. Retargeted feet are on the floor to a tenth of a millimetre; a foot that moves
#: by 0.3 mm from frame to frame has 0.01 m/s. The package's own clips lie as still as float32 is
#: exact, with less than 0.001 m/s³; seated they have 2.6.
_LEAST = {"skating": 0.01, "penetration": 0.2, "jerk": 0.5, "tremor": 1e-4, "rest": 0.01}


@dataclass(frozen=True)
class Value:
    """One measure of one phase; None where there is too little motion to measure."""

    motion: float | None
    """Of the motions in question."""
    mocap: float | None
    """Of held-out mocap."""
    least: float = 0.0
    """Values of mocap up to this one are 0 within the accuracy of the measure: skating 0.01 m/s,
    penetration 0.2 mm, jerk 0.5 m/s³, tremor 0.0001, rest 0.01."""

    @property
    def ratio(self) -> float | None:
        """Motion over mocap; None where either is missing, or mocap is at most `least`."""
        if self.motion is None or self.mocap is None or self.mocap <= self.least:
            return None
        return self.motion / self.mocap


@dataclass(frozen=True)
class Phase:
    """Measures of one phase."""

    seconds: tuple[float, float, float]
    """Durations of the motions, of held-out mocap and of the reference, s."""
    values: dict[str, Value]
    """By name in MEASURES."""


def compare(
    clips: Sequence[Clip],
    mocap: Sequence[Clip],
    groups: Sequence[str],
    folds: int = 3,
    seed: int = 0,
) -> dict[str, Phase]:
    """Return the measures of `clips` by phase, relative to held-out `mocap`.

    The mocap is halved `folds` times at random: one half is held out, the other is the reference,
    which distances are taken to. The values are means over the folds.

    groups: the group of each mocap clip, such as its subject or recording; groups are not divided.
    Raises ClipError for fewer than 4 groups.
    """
    names = sorted(set(groups))
    if len(names) < 4:
        raise ClipError(
            f"{len(names)} recordings to compare with: at least 4 are needed, so that half of them"
            " can be held out"
        )
    ours = phases.by_phase(clips)
    found: list[dict[str, Phase]] = []
    for fold in range(folds):
        order = np.random.default_rng((seed, fold)).permutation(len(names))
        chosen = {names[i] for i in order[: len(names) // 2]}
        held = [c for c, group in zip(mocap, groups, strict=True) if group in chosen]
        kept = [c for c, group in zip(mocap, groups, strict=True) if group not in chosen]
        theirs, among = phases.by_phase(held), phases.by_phase(kept)
        found.append(
            {
                phase: _phase(_in(ours, phase), _in(theirs, phase), _in(among, phase), seed)
                for phase in phases.PHASES
            }
        )
    return {phase: _mean([fold[phase] for fold in found]) for phase in phases.PHASES}


def _mean(folds: Sequence[Phase]) -> Phase:
    """Return the mean of a phase's values over folds; None where any is."""

    def mean(values: Sequence[float | None]) -> float | None:
        whole = [value for value in values if value is not None]
        return sum(whole) / len(whole) if len(whole) == len(values) else None

    seconds = np.mean([fold.seconds for fold in folds], axis=0).tolist()
    values = {
        name: Value(
            mean([fold.values[name].motion for fold in folds]),
            mean([fold.values[name].mocap for fold in folds]),
            _LEAST.get(name, 0.0),
        )
        for name in MEASURES
    }
    return Phase(tuple(seconds), values)


_Set = tuple[list[Motion], list[int]]


def _in(of: tuple[dict[str, list[Motion]], dict[str, list[int]]], phase: str) -> _Set:
    motions, owner = of
    return motions[phase], owner[phase]


def _phase(ours: _Set, theirs: _Set, among: _Set, seed: int) -> Phase:
    hz = character.CONTROL_HZ
    seconds = tuple(sum(len(m.qpos) for m in each[0]) / hz for each in (ours, theirs, among))
    first, second = _own(ours[0]), _own(theirs[0])
    values = {name: Value(first[name], second[name]) for name in first}
    values["spectral_distance"] = Value(
        _spectral(ours[0], among[0]), _spectral(theirs[0], among[0])
    )
    values["rest"] = Value(rest.outside(ours[0], among[0]), rest.outside(theirs[0], among[0]))
    values |= _compared(ours, theirs, among, seed)
    return Phase((seconds[0], seconds[1], seconds[2]), values)


def _own(motions: list[Motion]) -> dict[str, float | None]:
    """Return the measures of motions that need no reference; None without motion."""
    long = [motion for motion in motions if len(motion.qpos) >= 4]
    names = ("jerk", "skating", "penetration", "tremor", "walking_speed")
    if not long:
        return dict.fromkeys(names)
    figures = measures.measure(long)
    return {
        "jerk": figures.jerk_m_s3,
        "skating": figures.foot_skate_m_s,
        "penetration": 1000.0 * penetration_m(long),
        "tremor": figures.tremor_share,
        "walking_speed": walking_speed_m_s(long),
    }


def penetration_m(motions: Sequence[Motion]) -> float:
    """Return the depth of the character's lowest point below the floor, mean over all frames, m."""
    depth = []
    for motion in motions:
        limbs = clearance.points(motion.qpos.float())[..., 2] - clearance.RADII
        soles = measures.sole_corners(motion.qpos)[..., 2].flatten(1).float()
        low = torch.minimum(limbs.amin(dim=1), soles.amin(dim=1))
        depth.append((-low).clamp_min(0.0))
    return float(torch.cat(depth).double().mean())


def walking_speed_m_s(motions: Sequence[Motion]) -> float | None:
    """Return the median horizontal speed of roots faster than 0.3 m/s; None where none is."""
    speed = torch.cat([motion.qvel[:, :2].norm(dim=1) for motion in motions])
    speed = speed[speed > _WALKS_M_S]
    return float(speed.double().median()) if len(speed) else None


def _spectral(motions: list[Motion], reference: list[Motion]) -> float | None:
    sets = (motions, reference)
    if min(measures.spectrum_windows(each) for each in sets) < _SPECTRA:
        return None
    (_, power), (_, theirs) = (measures.spectrum(each, character.CONTROL_HZ) for each in sets)
    return measures.spectral_distance_db(power, theirs)


def _compared(ours: _Set, theirs: _Set, among: _Set, seed: int) -> dict[str, Value]:
    """Return the comparisons of windows: both sides with equally many windows, for the Fréchet
    distance falls with their number."""
    rows, mocap, reference = (_windows(each) for each in (ours, theirs, among))
    names = ("frechet", "separability", "coverage")
    least = 2 * comparison.COMPONENTS
    if min(len(each[0]) for each in (mocap, reference)) < least:
        return {name: Value(None, None) for name in names}
    basis = comparison.basis(reference[0], windows.LEAST)
    count = min(len(rows[0]), len(mocap[0])) if len(rows[0]) >= least else len(mocap[0])
    found = []
    for features, owner in (rows, mocap):
        if len(features) < least:
            found.append((None, None, None))
            continue
        few = basis.project(comparison.spread(features, count))
        found.append(
            (
                comparison.frechet(few, basis.project(reference[0])),
                _separated(basis, (features, owner), reference, seed),
                comparison.coverage(few, basis.project(reference[0])),
            )
        )
    return {name: Value(a, b) for name, a, b in zip(names, *found, strict=True)}


def _windows(of: _Set) -> tuple[Tensor, Tensor]:
    """Return windows [W, F] and the clip [W] that each is of."""
    motions, owner = of
    rows, index = windows.of_all(motions)
    return rows, torch.tensor(owner, dtype=torch.int64)[index] if len(index) else index


def _separated(
    basis: comparison.Basis, ours: tuple[Tensor, Tensor], theirs: tuple[Tensor, Tensor], seed: int
) -> float | None:
    """Return the separability, cross-validated: trained on every second clip of both sets, tested
    on the others, and the other way round."""
    halves = []
    for features, owner in (ours, theirs):
        clips = owner.unique()
        if len(clips) < 2:
            return None
        even = torch.isin(owner, clips[::2])
        rows = basis.scaled(features)
        halves.append((rows[even], rows[~even]))
    (a, b), (c, d) = halves
    found = [
        comparison.separability((a, c), (b, d), seed),
        comparison.separability((b, d), (a, c), seed),
    ]
    return float(np.mean(found)) if np.isfinite(found).all() else None
