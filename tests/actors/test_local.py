"""Threads share the scenes in whole blocks; their number changes no bit."""

import pytest

from actors.local import divide
from policy.errors import LayoutError
from tests.support.learning.points import assert_same, collect, fleet, weights
from world.errors import ConfigError


@pytest.mark.parametrize("workers", [2, 3, 6])
def test_same_bits_for_any_number_of_workers(workers):
    assert_same(collect(1), collect(workers))


def test_blocks_are_shared_whole():
    assert divide(64, 8, 3) == [range(24), range(24, 48), range(48, 64)]
    for scenes, block, workers in ((60, 8, 2), (16, 8, 3), (0, 8, 1)):
        with pytest.raises(ConfigError, match="multiple of 8"):
            divide(scenes, block, workers)


def test_a_state_is_taken_up_by_any_number_of_workers():
    one, three = fleet(1), fleet(3)
    one.collect(weights(), 0, 0.2)
    three.load_state_dict(one.state_dict())
    assert_same(one.collect(weights(), 1, 0.2), three.collect(weights(), 1, 0.2))
    one.close()
    three.close()


def test_a_state_of_other_scenes_is_refused():
    one, other = fleet(2), fleet(2, scenes=64)
    with pytest.raises(LayoutError, match="48 scenes, this fleet has 64"):
        other.load_state_dict(one.state_dict())
    one.close()
    other.close()
