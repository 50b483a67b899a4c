"""Stages and seats of a clip, and the ranges of it that are usable."""

from dataclasses import replace

import numpy as np

from world.motions import segments
from world.motions.clip import Clip
from world.motions.fit import seat


def test_two_seats_are_two_clips(sitting: Clip) -> None:
    second = replace(
        sitting, root_position_m=sitting.root_position_m + np.array([3, 0, 0], np.float32)
    )
    both = replace(
        sitting,
        root_position_m=np.concatenate((sitting.root_position_m, second.root_position_m)),
        local_rotation=np.concatenate((sitting.local_rotation, second.local_rotation)),
        seat=None,
    )
    parts = seat.with_seats(both)
    assert [part.name for part in parts] == [f"{sitting.name}#1", f"{sitting.name}#2"]
    points = [part.seat.point_m for part in parts if part.seat]
    np.testing.assert_allclose(points[1][0] - points[0][0], 3.0, atol=0.02)


def test_stages_come_in_order_and_say_what_the_body_does(carried: Clip, lain: Clip) -> None:
    for clip in (carried, lain):
        stage = segments.stages(clip)
        order = [int(stage[0]), *stage[1:][np.diff(stage) != 0].tolist()]
        assert order == [0, 1, 2, 1, 3]
    assert carried.box is not None and lain.bed is not None
    lifted = segments.stages(carried) == segments.CONTACT
    assert carried.box.held[lifted].all()
    # in contact the box is up at the carrying height; picking up and putting down are transitions
    assert np.ptp(carried.box.pose[lifted, 2]) < 0.12
    first, last = np.flatnonzero(carried.box.held)[[0, -1]]
    stage = segments.stages(carried)
    assert (stage[[first - 15, first, last, last + 15]] == segments.TRANSITION).all()
    lying_down = segments.stages(lain)
    assert (lying_down[lain.bed.from_frame : lain.bed.to_frame] == segments.CONTACT).all()
    upright = lain.root_position_m[:, 2] > 0.75
    assert not (lying_down[~upright] == segments.APPROACH).any()


def test_bad_ranges_are_found_where_they_were_made(carried: Clip) -> None:
    assert segments.usable(carried).all()
    jump = carried.root_position_m.copy()
    jump[60:] += np.array([0.5, 0, 0], np.float32)
    bad = ~segments.usable(replace(carried, root_position_m=jump))
    assert bad[59:61].all() and not bad[:55].any() and not bad[66:].any()
    # a body that stands and is pushed sideways at 1 m/s slides on both soles
    still = replace(
        carried,
        root_position_m=carried.root_position_m[:1].repeat(90, 0)
        + np.linspace([0, 0, 0], [0, 3, 0], 90, dtype=np.float32),
        local_rotation=carried.local_rotation[:1].repeat(90, 0),
        box=None,
    )
    assert (~segments.usable(still))[10:80].all()
    # the right arm laid straight through the chest
    crossed = still.local_rotation.copy()
    crossed[40:50, 1], crossed[40:50, 3] = (1, 0, 0, 0), (np.cos(0.6), np.sin(0.6), 0, 0)
    crossed[40:50, 4] = (1, 0, 0, 0)
    inside = segments.overlapping(replace(still, local_rotation=crossed))
    assert inside[40:50].all() and not inside[:40].any() and not inside[50:].any()
