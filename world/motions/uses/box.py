"""The use of boxes."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
import torch
from torch import Tensor

from world import rotations
from world.character import features
from world.motions import segments
from world.motions.clip import Clip
from world.motions.fit.box import with_box
from world.motions.mixture import StyleMixture
from world.motions.uses.use import (
    EXCLUDED,
    BoxFrames,
    ClipUse,
    FrameTable,
    Use,
    WindowBatch,
    use_at,
)
from world.objects import clearance
from world.scene.box import GROUND_M
from world.scene.target import Target

#: Lowest centre of a box in a reference state, m: people pick boxes up from the floor.
_LOWEST_M = GROUND_M + 0.05
#: While the box is in hand its stands are this much further from the person than where the clip has
#: the box, m: stands are ours, and who was recorded bends or walks where the plate is.
STAND_AWAY_M = 0.12


class BoxUse(ClipUse):
    """Picking a box up, carrying it and putting it down."""

    kind, holds = "box", True
    lacking, wanted = "no clip carries a box", "clips that do"

    def fit(self, clip: Clip) -> list[Clip]:
        """The clip with its box."""
        return with_box(clip)

    def read(self, clip: Clip) -> Use:
        """See ClipUse."""
        nothing = use_at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
        track = clip.box
        if track is None or not track.held.any():
            return nothing
        pose = torch.from_numpy(track.pose.astype(np.float32))
        rotation = rotations.normalise(pose[:, 3:])
        edges = np.flatnonzero(np.diff(np.concatenate(([0], track.held.astype(np.int8), [0]))))
        found = torch.from_numpy(segments.stages(clip))
        # leaving after the box is put down is no part of the task
        stage = torch.where(found == segments.LEAVE, EXCLUDED, found)
        first, last = int(edges[0]), min(int(edges[-1]), clip.frames - 1)
        box = BoxFrames(
            position=pose[:, :3],
            rotation=rotation,
            velocity=_rate(pose[:, :3]) * clip.fps,
            angular=_angular(rotation) * clip.fps,
            size=torch.tensor(track.size_m, dtype=torch.float32).expand(clip.frames, -1),
            held=torch.from_numpy(track.held),
            picked=_rest(pose, first).expand(clip.frames, -1),
            put=_rest(pose, last).expand(clip.frames, -1),
            has_put=torch.full((clip.frames,), int(edges[-1]) < clip.frames),
            has_picked=torch.full((clip.frames,), int(edges[0]) > 0),
        )
        return replace(nothing, has_object=True, stage=stage, box=box)

    def boxes(self, uses: Sequence[Use]) -> BoxFrames | None:
        """See ClipUse."""
        names = [field.name for field in fields(BoxFrames)]
        return BoxFrames(
            **{name: torch.cat([getattr(one.box, name) for one in uses]) for name in names}
        )

    def unfit(self, table: FrameTable) -> Tensor:
        """[F] bool: boxes so low that the episode would end at once, and limbs in a stand, which
        would throw the character; the clip's box stands for that of the episode."""
        box = table.box
        assert box is not None
        low = box.position[:, 2] < _LOWEST_M
        square = torch.tensor([1.0, 1.0, 1.0, 0.0])  # the target's stand is not turned
        for spot, shown in ((box.picked, box.has_picked), (square * box.put, box.has_put)):
            rows = torch.nonzero(shown).flatten()
            centres = clearance.points(table.qpos[rows])[:, clearance.LIMBS]
            rest = stands_away(spot[rows], table.qpos[rows, :2], box.held[rows])
            low[rows] |= (
                clearance.stand_depth(centres, rest, 0.5 * box.size[rows, 2]) > clearance.THROWN_M
            )
        return low

    def windows(
        self, table: FrameTable, batch: WindowBatch, mixture: StyleMixture, frames: int = 2
    ) -> tuple[Tensor, ...]:
        """See ClipUse: with the clip's box, or a relocated one on a stand."""
        box, index, relocated = table.box, batch.index, batch.relocated
        assert box is not None
        low, high = mixture.box_height_m
        height = low + (high - low) * batch.u[:, None]
        there = torch.cat((batch.anywhere, height), dim=1)
        turned = rotations.from_heading(batch.yaw)

        def state(frames: Tensor) -> Tensor:
            position = torch.where(relocated[:, None], there, box.position[frames])
            rotation = torch.where(relocated[:, None], turned, box.rotation[frames])
            around = features.posed_object_features(
                table.qpos[frames, :3], table.body.heading[frames], position, rotation
            )
            return torch.cat((table.body.features[frames], around), dim=1)

        return tuple(state(index + k) for k in range(2 - frames, 2))

    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """The clip itself, which has its box."""
        return clip


def stands_away(spot: Tensor, root: Tensor, held: Tensor) -> Tensor:
    """`spot` [n, k] (x and y first, m), where a box rests, moved away from the root [n, 2] by
    STAND_AWAY_M where the box is in hand, `held` [n]: its stand, or its target, is there."""
    way = spot[:, :2] - root
    unit = way / way.norm(dim=1, keepdim=True).clamp_min(1e-6)
    moved = spot[:, :2] + torch.where(held[:, None], STAND_AWAY_M, 0.0) * unit
    return torch.cat((moved, spot[:, 2:]), dim=1)


def _rest(pose: Tensor, frame: int) -> Tensor:
    """[4]: centre (m) and yaw (rad) of the box at a frame."""
    cos, sin = rotations.heading(pose[frame, 3:]).unbind(-1)
    return torch.cat((pose[frame, :3], torch.atan2(sin, cos)[None]))


def _rate(values: Tensor) -> Tensor:
    """Central differences per frame of rows [T, k], one-sided at both ends."""
    return torch.gradient(values, dim=0)[0]


def _angular(rotation: Tensor) -> Tensor:
    """[T, 3]: rotation per frame, rad, in the body's own axes: the mean of both adjacent steps."""
    step = rotations.to_rotation_vector(
        rotations.multiply(rotations.conjugate(rotation[:-1]), rotation[1:])
    )
    ends = torch.cat((step[:1], step, step[-1:]))
    return 0.5 * (ends[1:] + ends[:-1])


BOX = BoxUse()
