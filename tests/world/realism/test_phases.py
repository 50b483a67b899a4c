"""Phases are the stages of clips, in contiguous stretches."""

import numpy as np
import pytest

from world.motions import segments
from world.motions.synthetic import library
from world.realism import phases


def test_stretches_make_up_the_clip() -> None:
    generator = np.random.default_rng(0)
    clip = library.sitting(generator, 0.44, 1.5, 0.3, 1, back=True)
    walk = library.walking(generator, 1.0)
    motions, owner = phases.by_phase([walk, clip])
    assert [len(m.qpos) for m in motions["all"]] == [walk.frames, clip.frames]
    assert owner["all"] == [0, 1] and owner["contact"] == [1]
    stage = segments.stages(clip)
    assert len(motions["contact"][0].qpos) == (stage == segments.CONTACT).sum() > 0
    assert sum(len(m.qpos) for m in motions["transition"]) == (stage == segments.TRANSITION).sum()
    apart = sum(len(m.qpos) for phase in phases.PHASES[1:] for m in motions[phase])
    assert apart == walk.frames + clip.frames


def test_noise_turns_each_joint_by_its_deviation() -> None:
    clip = library.walking(np.random.default_rng(0), 1.0)
    (shaken,) = phases.noised([clip], 0.02)
    dot = np.abs((clip.local_rotation * shaken.local_rotation).sum(axis=-1)).clip(0.0, 1.0)
    angle = 2.0 * np.arccos(dot.astype(np.float64))
    # the length of a vector of three normal numbers has a mean square of 3
    assert np.sqrt((angle**2).mean()) == pytest.approx(0.02 * 3**0.5, rel=0.03)
    np.testing.assert_array_equal(shaken.root_position_m, clip.root_position_m)
