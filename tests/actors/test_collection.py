"""Every scene once, whoever delivers, dies or is late."""

import random
import time

import pytest

from actors.cluster import ray_session
from actors.collection import Collection


@pytest.fixture(scope="module", autouse=True)
def ray():
    with ray_session(cpus=4, object_store_bytes=100 * 2**20):
        yield


class TestCollection:
    """Every scene once, whoever delivers, dies or is late: on eight blocks of one scene."""

    def collection(self) -> Collection:
        found = Collection(range(8), 1, straggler_s=10.0, straggler_factor=2.0)
        found.assign("a", "A", range(4))
        found.assign("b", "B", range(4, 8))
        found.queue_unassigned()
        assert not found.queued
        return found

    def deliver(self, asked: Collection, reference: str) -> bool:
        return asked.deliver(asked.jobs[reference], {"of": reference}, {})

    def taken(self, asked: Collection) -> dict[range, str]:
        return {scenes: packed["of"] for scenes, (packed, _) in asked.results.items()}

    def test_what_a_dead_actor_had_is_owed_in_parts(self):
        asked = self.collection()
        assert asked.fail(asked.jobs["a"]) == 1
        assert asked.next_part(helpers=3) == (range(2), 1)
        assert asked.next_part(helpers=1) == (range(2, 4), 1)
        assert not asked.queued and not asked.complete

    def test_a_late_result_replaces_its_parts_and_later_results_do_not_count(self):
        asked = self.collection()
        self.deliver(asked, "b")
        asked.queue_stragglers(time.monotonic() + 5)
        assert not asked.queued, "late only after 10 s"
        asked.queue_stragglers(time.monotonic() + 11)
        assert asked.next_part(2) == (range(2), 0)
        asked.assign("a1", "B", range(2))
        assert self.deliver(asked, "a1")
        assert self.taken(asked) == {range(4, 8): "b", range(2): "a1"}
        asked.assign("a2", "B", asked.next_part(1)[0])
        assert self.deliver(asked, "a")
        assert self.taken(asked) == {range(4, 8): "b", range(4): "a"} and asked.complete
        assert not self.deliver(asked, "a2")
        assert asked.complete and asked.stragglers == 1

    def test_a_dead_helper_leaves_its_part_to_be_done_though_the_straggler_has_it(self):
        asked = self.collection()
        self.deliver(asked, "b")
        asked.queue_stragglers(time.monotonic() + 11)
        asked.assign("a1", "B", asked.next_part(1)[0])
        assert asked.fail(asked.jobs["a1"]) == 1
        assert asked.queued == [(range(4), 1)]
        asked.assign("a1", "B", *asked.next_part(1))
        assert asked.fail(asked.jobs["a1"]) == 2
        asked.fail(asked.jobs["a"])
        assert asked.queued == [(range(4), 2)], "not twice"

    def test_there_is_no_straggler_while_most_workers_are_busy(self):
        asked = self.collection()
        assert asked.next_straggler_s is None
        self.deliver(asked, "b")
        assert asked.next_straggler_s is not None

    def test_parts_of_two_stragglers_are_not_joined(self):
        """Two helpers have the adjacent ends of two stragglers' parts, and both are lost. One part
        of both ends would be in neither straggler's, whose late answer then counted twice what it
        has in common with it, in the place of scenes that nobody had."""
        asked = self.collection()
        asked.assign("c", "C", range(0))  # a third member has answered
        self.deliver(asked, "c")
        del asked.results[range(0)]
        asked.assign("d", "D", range(0))
        self.deliver(asked, "d")
        del asked.results[range(0)]
        asked.queue_stragglers(time.monotonic() + 11)
        assert [part for part, _ in asked.queued] == [range(4), range(4, 8)]
        asked.queued.clear()
        asked.assign("a1", "C", range(3, 4))
        asked.assign("b1", "D", range(4, 5))
        asked.fail(asked.jobs["a1"])
        asked.fail(asked.jobs["b1"])
        assert asked.queued == [(range(3, 4), 1), (range(4, 5), 1)]
        assert self.deliver(asked, "a")
        assert asked.queued == [(range(4, 5), 1)]

    @pytest.mark.parametrize("seed", range(40))
    def test_every_scene_is_used_once_whatever_happens(self, seed: int) -> None:
        """Workers answer, are late and fail in a random order."""
        draw = random.Random(seed)
        asked = Collection(range(24), 2, straggler_s=1.0, straggler_factor=1.0)
        for k in range(4):
            asked.assign(f"start{k}", f"m{k}", range(6 * k, 6 * k + 6))
        for step in range(2000):
            if asked.complete:
                break
            if asked.queued and (draw.random() < 0.5 or not asked.jobs):
                part, failures = asked.next_part(draw.randint(1, 3))
                asked.assign(f"{step}", f"h{step}", part, failures)
            elif draw.random() < 0.3:
                asked.queue_stragglers(time.monotonic() + 1e6)
            elif asked.jobs:
                job = asked.jobs[draw.choice(sorted(asked.jobs))]
                if draw.random() < 0.5 and step < 1000:
                    asked.fail(job)
                else:
                    asked.deliver(job, {"of": ""}, {})
        used = sorted(scene for part in asked.results for scene in part)
        assert asked.complete and used == list(range(24))
