"""Which fleets are told ahead what comes next."""

from actors.fleet import RayFleet
from actors.local import LocalFleet
from learner.protocols import PrefetchingFleet
from tests.support.point_shard import PointShard


def test_only_a_fleet_that_can_begin_ahead_is_foresighted() -> None:
    local = LocalFleet(PointShard, 8, 8, 1)
    assert not isinstance(local, PrefetchingFleet)
    local.close()
    assert issubclass(RayFleet, PrefetchingFleet)
