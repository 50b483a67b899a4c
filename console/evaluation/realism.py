"""Motion quality of an evaluation, with the same figures of the mocap as a reference."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.evaluation import penetration
from console.evaluation.stepping import Track
from console.evaluation.style_judge import StyleJudge
from discriminator import normaliser
from world import tasks
from world.character import model as character
from world.config import WorldConfig
from world.furniture.piece import Piece
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.realism import measures
from world.realism.measures import Motion

#: Transitions whose nearest neighbour is searched, and mocap transitions to search.
_QUERIES, _REFERENCES = 2000, 60_000
#: Interval of the frames whose overlap with furniture is measured; number of mocap states.
_EVERY, _MOCAP_STATES = 3, 512
#: Mocap transitions that the discriminator scores.
_SCORED = 20_000


def quality_of(
    tracks: Sequence[Track],
    world: WorldConfig,
    library: MotionLibrary | None,
    pieces: Sequence[Piece],
    judge: StyleJudge | None,
    seed: int = 0,
) -> dict[str, Any]:
    """Return the figures of recorded trials before their falls, and of the library's clips.

    Without a library the mocap figures and the distances to mocap are null; without a judge the
    style reward is.
    """
    motions = [motion_of(track) for track in tracks]
    ours = asdict(measures.measure(motions)) | _overlap_figures(_overlaps(tracks))
    frequency, power = measures.spectrum(motions, character.CONTROL_HZ)
    measured = bool(power.any())
    figures: dict[str, Any] = {
        "trials": len(tracks),
        "policy": ours | {"nearest_mocap": None, "style_reward": _style(judge, tracks)},
        "mocap": None,
        "spectral_distance_db": None,
        "spectrum": {"hz": frequency.tolist(), "policy": None, "mocap": None},
    }
    if measured:
        figures["spectrum"]["policy"] = power.tolist()
    if library is None:
        return figures
    clips, labels = clips_of(library)
    theirs = asdict(measures.measure(clips))
    theirs |= _overlap_figures(_mocap_overlaps(world, library, pieces, seed))
    _, mocap_power = measures.spectrum(clips, character.CONTROL_HZ)
    distance, yardstick = _nearest(motions, clips, labels)
    figures["policy"]["nearest_mocap"] = distance
    figures["mocap"] = theirs | {
        "nearest_mocap": yardstick,
        "style_reward": _mocap_style(judge, library, seed),
    }
    if measured:
        figures["spectral_distance_db"] = measures.spectral_distance_db(power, mocap_power)
    figures["spectrum"]["mocap"] = mocap_power.tolist()
    return figures


def motion_of(track: Track) -> Motion:
    """Return the motion of a recorded trial up to its fall."""
    take = track.take
    qpos = take.qpos[: track.steps, : character.NQ]
    qvel = take.qvel[: track.steps, : character.NV]
    return Motion(torch.from_numpy(qpos), torch.from_numpy(qvel))


def clips_of(library: MotionLibrary) -> tuple[list[Motion], list[int]]:
    """Return the clips of a library without mirror images, and the index of the recording that each
    belongs to."""
    motions, labels, start = [], [], 0
    names: dict[str, int] = {}
    for clip in library.clips:
        here = slice(start, start + clip.frames)
        start = here.stop
        if not clip.name.endswith("~mirrored"):
            motions.append(Motion(library.qpos[here], library.qvel[here]))
            labels.append(names.setdefault(clip.name, len(names)))
    return motions, labels


def _overlaps(tracks: Sequence[Track]) -> NDArray[np.float64]:
    """Return the deepest overlap with the furniture, m, in every third frame of the tracks."""
    parts = [
        penetration.depth(
            track.model,
            track.take.qpos,
            track.take.mocap_pos,
            track.take.mocap_quat,
            range(0, track.steps, _EVERY),
        )
        for track in tracks
    ]
    return np.concatenate(parts) if parts else np.zeros(0)


def _mocap_overlaps(
    world: WorldConfig, library: MotionLibrary, pieces: Sequence[Piece], seed: int
) -> NDArray[np.float64]:
    """Return the same for states of clips, with furniture placed as in reference states, since the
    real furniture was not recorded. Empty without clips that use furniture."""
    affordance = tasks.make(world.task).affordance
    states = affordance.clip_states(world, library, pieces, seed, _MOCAP_STATES)
    if states is None:
        return np.zeros(0)
    half = 0.5 * torch.atan2(states.yaw[:, 1], states.yaw[:, 0])
    quat = torch.stack((half.cos(), 0 * half, 0 * half, half.sin()), dim=1).double().numpy()
    qpos, origin = states.qpos.double().numpy(), states.origin.double().numpy()
    return np.concatenate(
        [
            penetration.depth(model, qpos, origin, quat, [row])
            for row, model in enumerate(states.models)
        ]
    )


def _overlap_figures(depth_m: NDArray[np.float64]) -> dict[str, float | None]:
    touching = depth_m[depth_m > 0]
    return {
        "furniture_overlap_m": float(touching.mean()) if len(touching) else None,
        "furniture_overlap_p99_m": float(np.percentile(depth_m, 99)) if len(depth_m) else None,
    }


def _nearest(
    motions: list[Motion], clips: list[Motion], labels: list[int]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the distances to the nearest mocap transition: of the policy, and of each clip to the
    other clips."""
    reference = torch.cat([measures.transitions(clip) for clip in clips])
    label = torch.cat(
        [
            torch.full((max(0, len(clip.qpos) - 1),), own)
            for clip, own in zip(clips, labels, strict=True)
        ]
    )
    mean, deviation = normaliser.fit(reference)
    reference = normaliser.normalise(reference, mean, deviation)
    chosen = _spread(len(reference), _REFERENCES)
    among, among_label = reference[chosen], label[chosen]
    query = torch.cat([measures.transitions(m) for m in motions if len(m.qpos) > 1])
    query = normaliser.normalise(query[_spread(len(query), _QUERIES)], mean, deviation)
    own = _spread(len(reference), _QUERIES)
    return (
        _summary(measures.nearest(query, among)),
        _summary(measures.nearest(reference[own], among, (label[own], among_label))),
    )


def _spread(total: int, count: int) -> Tensor:
    """Return at most `count` indices, evenly spaced over `total`."""
    return torch.linspace(0, total - 1, min(total, count)).long()


def _summary(distance: Tensor) -> dict[str, float]:
    distance = distance[distance.isfinite()].double()
    if not len(distance):
        return {}
    return {
        "median": float(distance.median()),
        "p95": float(distance.quantile(0.95)),
    }


def _style(judge: StyleJudge | None, tracks: Sequence[Track]) -> float | None:
    if judge is None or not tracks:
        return None
    rewards = [style_rewards(judge, track) for track in tracks]
    return float(torch.cat(rewards).double().mean())


def style_rewards(judge: StyleJudge, track: Track) -> Tensor:
    """Return the style reward of each transition of a track before its fall, [T - 1]; for a judge
    of longer windows, of each of these that is whole."""
    states = torch.from_numpy(track.state[: track.steps])
    count = max(0, len(states) - judge.window + 1)
    return judge.reward(*(states[k : k + count] for k in range(judge.window)))


def _mocap_style(judge: StyleJudge | None, library: MotionLibrary, seed: int) -> float | None:
    if judge is None:
        return None
    source = StyleSource(library, seed, StyleMixture(), judge.window)
    return float(judge.reward(*source.sample(_SCORED, 0)).double().mean())
