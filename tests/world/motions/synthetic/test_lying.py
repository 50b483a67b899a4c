"""Lying: the trunk on the bed."""

import numpy as np

from tests.support.world.synthetic import Posed


def test_the_trunk_rests_on_the_bed_and_nothing_sinks_into_it(every: list[Posed]) -> None:
    beds = [(one, one.clip.bed) for one in every if one.clip.bed is not None]
    assert {round(bed.height_m, 2) for _, bed in beds} >= {0.30, 0.42, 0.55}
    for one, bed in beds:
        lying = slice(bed.from_frame, bed.to_frame)
        pelvis = one.positions[:, 0] + 0.07 * one.world[:, 0, :, 2]
        chest = one.positions[:, 1] + 0.12 * one.world[:, 1, :, 2]
        assert np.abs(pelvis[lying, 2] - 0.09 - bed.height_m).max() < 0.01, one.clip.name
        assert np.abs(chest[lying, 2] - 0.11 - bed.height_m).max() < 0.02, one.clip.name
        head = one.positions[:, 2] + 0.175 * one.world[:, 2, :, 2]
        off = head[lying, :2].mean(0) - bed.head_m[:2]
        assert np.linalg.norm(off) < 0.03, one.clip.name
        assert np.abs(one.positions[lying, 0, :2] - bed.hip_m[:2]).max() < 0.01, one.clip.name
        # whatever is over the mattress stays out of it: 3 cm of give under limbs and trunk
        away = one.positions[..., :2] - np.array(bed.hip_m[:2])
        inward = away @ -np.array([np.cos(bed.facing_rad), np.sin(bed.facing_rad)])
        over = inward > 0.0
        for body, radius in ((5, 0.04), (8, 0.04), (4, 0.04), (7, 0.04), (11, 0.03), (14, 0.03)):
            under = one.positions[:, body, 2] - radius - bed.height_m
            assert under[over[:, body]].min(initial=1.0) > -0.03, (one.clip.name, body)
