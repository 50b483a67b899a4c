"""The use of beds."""

from dataclasses import replace

import torch
from torch import Tensor

from world.character import features
from world.motions import segments
from world.motions.clip import Clip
from world.motions.fit.bed import with_beds
from world.motions.mixture import StyleMixture
from world.motions.objects import Bed
from world.motions.uses.seat import point_of, yaw_of
from world.motions.uses.use import APPROACH, StandingObjectUse, Use, use_at
from world.scene.target import Target

#: Root height from which a character stands on its feet, m.
_STANDS_M = 0.75


class BedUse(StandingObjectUse):
    """Lying down on a bed and getting up."""

    kind = "bed"
    lacking, wanted = "no clip uses a bed", "clips that lie down"

    def fit(self, clip: Clip) -> list[Clip]:
        """Parts with at most one bed each."""
        return with_beds(clip)

    def read(self, clip: Clip) -> Use:
        """See ClipUse."""
        bed = clip.bed
        if bed is None:
            return use_at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
        found = torch.from_numpy(segments.stages(clip))
        stage = torch.where(found == segments.LEAVE, APPROACH, found)
        return use_at(clip, bed.hip_m, bed.head_m, bed.facing_rad, stage)

    def raised(
        self, own: Tensor, root: Tensor, u: Tensor, mixture: StyleMixture
    ) -> tuple[Tensor, Tensor]:
        """See StandingObjectUse: characters that lie or sit on a bed, on a higher one."""
        low, high = mixture.raised_m
        down = ((_STANDS_M - root[:, 2:]) / 0.15).clamp(0.0, 1.0)
        up = down * (low + (high - low) * u[:, None])
        height = features.STATE.slice("root_height")
        assert height == slice(0, 1)
        return torch.cat((own[:, :1] + up, own[:, 1:]), dim=1), torch.cat(
            (root[:, :2], root[:, 2:] + up), dim=1
        )

    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """See ClipUse."""
        assert target.head is not None, "a target for lying has a head"
        hip, head = point_of(target.point), point_of(target.head)
        bed = Bed(hip, (head[0], head[1], hip[2]), yaw_of(target.facing), *run)
        return replace(clip, bed=bed)


BED = BedUse()
