"""Clips are learned from where they walk."""

import torch

from world.motions import load
from world.motions.library import MotionLibrary, StyleMixture, StyleSource
from world.motions.uses.floor import FLOOR
from world.motions.uses.use import EXCLUDED


def test_clips_are_learned_from_where_they_walk() -> None:
    wanted = ("walk_1.0", "stop_0.8", "turn_90")
    clips = [clip for clip in load.own_clips() if clip.name in wanted or clip.seat is not None]
    library = MotionLibrary(clips[:6], use=FLOOR)
    for clip in library.clips:
        used = FLOOR.read(clip)
        height = torch.from_numpy(clip.root_position_m[:, 2])
        assert bool((height[used.kept] > 0.72).all())
        assert torch.equal(used.stage == EXCLUDED, ~used.kept)
        if clip.seat is not None:
            assert not used.kept[clip.seat.from_frame : clip.seat.to_frame].any()
    # the target of a frame is on the way of its clip
    walk = next(clip for clip in library.clips if clip.name == "walk_1.0")
    used = FLOOR.read(walk)
    path = torch.from_numpy(walk.root_position_m[:, :2])
    gap = torch.cdist(used.point[used.kept, :2], path).amin(dim=1)
    assert float(gap.max()) < 1e-6 and bool((used.point[:, 2] == 0.0).all())
    states, following = StyleSource(library, 0, StyleMixture()).sample(256, 1)
    assert states.shape == following.shape == (256, 114)
    assert bool((states[:, 0] > 0.7).all())  # nobody sits
