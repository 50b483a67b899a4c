"""Contacts of a recording: standing feet stand."""

from dataclasses import replace

import numpy as np

from tests.support import foreign_motions
from world.motions import measures
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.formats import landmarks
from world.motions.retarget import body, contacts, convert


def test_standing_feet_stand(walking: Clip, imported: Clip) -> None:
    # the recorded feet tremble by a centimetre where they should stand
    recording = foreign_motions.recorded(walking)
    shaken = recording.position.copy()
    noise = np.random.default_rng(1).normal(size=(len(shaken), 1, 3)) * [0.6, 0.0, 0.6]
    shaken[:, [11, 14, 15, 16]] += noise
    clip = convert.retargeted(replace(recording, position=shaken))
    before, after = measures.skates_m_s(clip)
    assert before > 0.15
    assert after < 0.5 * before
    assert measures.skates_m_s(imported)[1] < 0.05
    # a foot that was flat and still is: sole on the floor, level
    position, rotation = poses.body_poses(imported)
    target = body.targets(
        body.scaled(foreign_motions.recorded(walking), landmarks.find(
            foreign_motions.recorded(walking)), 30)
    )  # fmt: skip
    flat = contacts.find(target, 30).flat
    assert flat.sum() > 15
    ankles = position[:, [11, 14], 2].numpy()[flat]
    np.testing.assert_allclose(ankles, body.ANKLE_M, atol=0.006)
    assert (rotation[:, [11, 14], 2, 2].numpy()[flat] > np.cos(np.deg2rad(4))).all()
