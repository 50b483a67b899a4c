"""The use of seats."""

import math
from dataclasses import replace

import torch

from world.motions import segments
from world.motions.clip import Clip
from world.motions.fit.seat import with_seats
from world.motions.objects import Point, Seat
from world.motions.uses.use import APPROACH, StandingObjectUse, Use, use_at
from world.scene.target import Target


class SeatUse(StandingObjectUse):
    """Sitting down on a seat and getting up."""

    kind = "seat"
    lacking, wanted = "no clip uses a seat", "clips that sit down"

    def fit(self, clip: Clip) -> list[Clip]:
        """Parts with at most one seat each."""
        return with_seats(clip)

    def read(self, clip: Clip) -> Use:
        """See ClipUse."""
        seat = clip.seat
        if seat is None:
            return use_at(clip, None, None, 0.0, torch.zeros(clip.frames, dtype=torch.int64))
        found = torch.from_numpy(segments.stages(replace(clip, box=None, bed=None)))
        stage = torch.where(found == segments.LEAVE, APPROACH, found)
        return use_at(clip, seat.point_m, seat.point_m, seat.facing_rad, stage)

    def with_object(self, clip: Clip, target: Target, run: tuple[int, int]) -> Clip:
        """See ClipUse."""
        return replace(clip, seat=Seat(point_of(target.point), yaw_of(target.facing), *run))


def point_of(rows: torch.Tensor) -> Point:
    """The point of rows [1, 3], m."""
    x, y, z = rows[0].tolist()
    return x, y, z


def yaw_of(facing: torch.Tensor) -> float:
    """The yaw of directions [1, 2], rad."""
    cos, sin = facing[0].tolist()
    return math.atan2(sin, cos)


SEAT = SeatUse()
