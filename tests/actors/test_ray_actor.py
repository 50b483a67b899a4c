"""What crosses to a Ray actor and back."""

from actors.ray_actor import pack_rollout, unpack_rollout
from tests.support.learning.fleets import assert_same


def test_packed_and_back(undisturbed):
    assert_same([unpack_rollout(pack_rollout(r)) for r in undisturbed], undisturbed)
