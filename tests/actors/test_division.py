"""Blocks of scenes for actors of different speeds, by hand and by enumeration."""

import pytest

from actors.cluster import ray_session
from actors.division import block_counts, consecutive_ranges, makespan


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=4, object_store_bytes=100 * 2**20):
        yield


def test_block_counts_by_hand():
    assert block_counts(32, [1.0, 1.0, 1.0, 1.0]) == [8, 8, 8, 8]
    assert block_counts(7, [1.0, 1.0, 1.0]) == [3, 2, 2]
    # Rates 1, 1, 1 and 1/10: the last one has one block when the others have ten.
    assert block_counts(32, [1.0, 1.0, 1.0, 10.0]) == [11, 10, 10, 1]
    assert makespan([11, 10, 10, 1], [1.0, 1.0, 1.0, 10.0]) == 11.0
    assert block_counts(6, [10.0, 1.0, 1.0]) == [0, 3, 3]
    assert consecutive_ranges([2, 0, 1], 8) == [range(16), range(16, 16), range(16, 24)]


@pytest.mark.parametrize("actors", [2, 4, 10])
def test_a_tenth_of_the_speed_is_no_dearer_than_no_actor(actors):
    """By enumeration of all divisions that give the others the same: none is done earlier."""
    costs = [10.0] + [1.0] * (actors - 1)
    blocks = 8 * actors
    best = min(
        makespan([own, *_even(blocks - own, actors - 1)], costs) for own in range(blocks + 1)
    )
    found = makespan(block_counts(blocks, costs), costs)
    assert found == best <= max(_even(blocks, actors - 1))


def _even(blocks: int, actors: int) -> list[int]:
    return [blocks // actors + (i < blocks % actors) for i in range(actors)]
