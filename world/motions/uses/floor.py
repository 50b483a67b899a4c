"""The use of the floor alone: walking."""

from dataclasses import replace

import numpy as np
import torch

from world import rotations
from world.motions import segments
from world.motions.clip import Clip
from world.motions.fit.objects import with_any
from world.motions.fit.poses import stretches
from world.motions.uses.use import APPROACH, EXCLUDED, UPRIGHT_M, StandingObjectUse, Use, use_at
from world.scene.target import Target

#: Least and greatest time by which the target of a walking frame is ahead in its clip, s.
_AHEAD_S = (0.5, 5.0)


class FloorUse(StandingObjectUse):
    """Walking, turning and standing, in any clip."""

    lacking, wanted = "no clip walks", "clips that do"
    # the task ends standing still
    idle_every = 3

    def fit(self, clip: Clip) -> list[Clip]:
        """Parts with their objects of any use, which delimit the walking frames."""
        return with_any(clip)

    def read(self, clip: Clip) -> Use:
        """The walking stretches of a clip; the target of a frame is its position some seconds later
        in the same stretch."""
        found = segments.stages(clip)
        on_foot = (found == segments.APPROACH) | (found == segments.LEAVE)
        on_foot &= clip.root_position_m[:, 2] > UPRIGHT_M
        goal = np.arange(clip.frames)
        for start, stop in stretches(on_foot):
            frames = np.arange(start, stop)
            # spread by the golden ratio, so that adjacent frames have near and far targets
            ahead_s = _AHEAD_S[0] + (_AHEAD_S[1] - _AHEAD_S[0]) * (
                (frames * 0.6180339887498949) % 1.0
            )
            goal[start:stop] = np.minimum(frames + np.round(ahead_s * clip.fps), stop - 1)
        level = np.array([1.0, 1.0, 0.0], np.float32)
        point = torch.from_numpy(clip.root_position_m[goal].astype(np.float32) * level)
        heading = rotations.heading(torch.from_numpy(clip.local_rotation[goal, 0]).float())
        stage = torch.from_numpy(np.where(on_foot, APPROACH, EXCLUDED))
        nothing = use_at(clip, None, None, 0.0, stage)
        kept = torch.from_numpy(on_foot)
        return replace(
            nothing,
            has_object=bool(on_foot.any()),
            point=point,
            head=point,
            facing=heading,
            kept=kept,
        )

    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """The clip itself: there is no object."""
        return clip


FLOOR = FloorUse()
