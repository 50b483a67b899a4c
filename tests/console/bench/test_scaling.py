"""Many actors: what the stand-ins send, weights that cross once a node, and the bench's figures."""

import os
import re
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ray
from ray.cluster_utils import Cluster

from actors import fleet as ray_fleet
from actors.cluster import START_S, on_loopback, startup_timeouts
from actors.fleet import FleetConfig, RayFleet
from actors.ray_actor import RolloutActor
from console.bench import scaling
from policy.rollout import Rollout
from tests.support.console.stand_ins import weights
from tests.support.faulty_shard import MakePoints
from tests.support.paths import ROOT
from tests.support.point_shard import ACTION, GOAL, STATE

SCENES, HORIZON, NODES, ACTORS_A_NODE = 8, 4, 2, 2


class Whereabouts(RolloutActor):
    """An actor that remembers where in memory the weights of each rollout lay."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.seen: dict[int, tuple[str, int]] = {}

    def part(self, scenes, state, weights, version, horizon, sigma):
        self.seen[version] = place(max(weights.values(), key=lambda array: array.nbytes))
        return super().part(scenes, state, weights, version, horizon, sigma)

    def whereabouts(self) -> tuple[str, dict[int, tuple[str, int]]]:
        return ray.get_runtime_context().get_node_id(), self.seen


def place(array: np.ndarray) -> tuple[str, int]:
    """The shared segment that an array lies in, by its inode, and the offset within it."""
    address = array.__array_interface__["data"][0]
    for line in Path("/proc/self/maps").read_text().splitlines():
        fields = line.split()
        first, last = (int(end, 16) for end in fields[0].split("-"))
        if first <= address < last:
            return f"{fields[3]}/{fields[4]}", address - first + int(fields[2], 16)
    raise AssertionError("the array lies nowhere")


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Cluster]:
    """A head without slots, where the learner is, and nodes with a store of their own each."""
    root = str(ROOT)
    before = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, [root, before])))
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    settings: dict[str, Any] = {
        "object_store_memory": 100 * 2**20,
        "include_dashboard": False,
        "node_ip_address": "127.0.0.1",
    }
    head = settings | {"num_cpus": 0, "_system_config": {"debug_dump_period_milliseconds": 200}}
    with on_loopback(), startup_timeouts(START_S):
        found = Cluster(initialize_head=True, head_node_args=head)
        try:
            for _ in range(NODES):
                found.add_node(num_cpus=ACTORS_A_NODE, **settings)
            ray.init(address=found.address, log_to_driver=False, logging_level="ERROR")
            yield found
        finally:
            ray.shutdown()
            found.shutdown()


def chunks_received(cluster: Cluster) -> dict[str, int]:
    """Pieces of objects (of up to 5 MB) that each node has received, by its id: what it logs.

    The nodes of one machine write to the same file in turn.
    """
    dump = Path(cluster.head_node.get_session_dir_path()) / "logs" / "debug_state.txt"
    since, until = time.time(), time.monotonic() + 60
    found: dict[str, int] = {}
    while len(found) < NODES + 1 and time.monotonic() < until:
        fresh, text = dump.stat().st_mtime > since, dump.read_text()
        node = re.search(r"Node ID: (\w+)", text)
        count = re.search(r"num chunks received total: (\d+)", text)
        if fresh and node and count:
            found[node[1]] = int(count[1])
        time.sleep(0.01)
    assert len(found) == NODES + 1, "every node has logged"
    return found


def test_weights_cross_once_a_node(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ray_fleet, "RolloutActor", Whereabouts)
    # on a busy machine one may look so slow that its scenes are given to others
    monkeypatch.setattr(ray_fleet, "_DIVISION_ROLLOUTS", 1_000)
    actors = NODES * ACTORS_A_NODE
    config = FleetConfig(start_s=120, rollout_s=120, straggler_s=120)
    fleet = RayFleet(MakePoints(), 8 * actors, 8, actors, seed=5, horizon=HORIZON, config=config)
    handles = [member.handle for member in fleet._members]
    fleet.collect(weights(0), 0, 0.1)
    before = chunks_received(cluster)
    versions = range(1, 6)
    for version in versions:
        fleet.collect(weights(version), version, 0.1)
    after = chunks_received(cluster)
    seen: Mapping[str, dict] = {}
    for node, places in ray.get([handle.whereabouts.remote() for handle in handles]):
        seen.setdefault(node, []).append(places)
    assert sorted(len(found) for found in seen.values()) == [ACTORS_A_NODE] * NODES
    for found in seen.values():
        for version in versions:
            places = {places[version] for places in found}
            assert len(places) == 1, "the actors of a node read the same memory"
    # A node receives one object a version, whatever the number of its actors. The learner's
    # receives none: rollouts as small as these come with the reply.
    received = sorted(after[name] - before[name] for name in after)
    assert received == [0] + [len(versions)] * NODES
    fleet.close()


def test_size_of_a_sample_by_hand(part: Rollout) -> None:
    ends = len(part.end_index)
    steps = SCENES * HORIZON
    wide = (HORIZON + 1) * SCENES * (STATE + GOAL) + steps * (2 * ACTION + 2)
    by_hand = 4 * wide + 3 * steps + 8 * 2 * SCENES + ends * (16 + 4 * (STATE + GOAL) + 5 * 4)
    assert scaling.size(part) == by_hand


def test_ingest_by_hand(part: Rollout) -> None:
    spent = {
        1: scaling.Spent([2.0, 2.0, 2.0, 2.0], [0.1] * 4, [0.05] * 4),
        10: scaling.Spent([2.0, 2.5, 4.0, 2.5], [0.5] * 4, [0.25] * 4),
    }
    samples = part.samples
    found = scaling.ingested(spent, part, took_s=2.0, limit=4.5 * samples)
    assert found["actors_1_to_ideal_ratio"] == found["actors_1_to_reachable_ratio"] == 1.0
    assert found["actors_10_ideal_samples_per_s"] == 10 * samples / 2
    assert found["actors_10_samples_per_s"] == 10 * samples / 2.5
    assert found["actors_10_to_ideal_ratio"] == pytest.approx(0.8)
    # 10 actors' ideal of 5 parts a second is beyond the limit of 4.5.
    assert found["actors_10_to_reachable_ratio"] == pytest.approx(4 / 4.5)
    # Of 2, 2.5, 2.5 and 4 s, three tenths of the way from the first to the second.
    assert found["actors_10_fast_tenth_to_ideal_ratio"] == pytest.approx(2 / 2.15)
    assert found["actors_10_fast_tenth_to_reachable_ratio"] == pytest.approx(10 / 2.15 / 4.5)
    assert found["actors_10_processor_us_per_sample"] == pytest.approx(0.5e6 / (10 * samples))
    assert found["actors_10_thread_us_per_sample"] == pytest.approx(0.25e6 / (10 * samples))


def test_limits_by_hand() -> None:
    # Of 0.3 and 0.5 s, one tenth of the way from the first to the second, and so on.
    ready = scaling.Spent([9.0] * 2, [0.3, 0.5], [0.2, 0.2])
    received = scaling.Spent([9.0] * 2, [0.08, 0.08], [0.0] * 2)
    found = scaling.limits(ready, received, samples=1000, width=900.0)
    assert found["limit_samples_per_s"] == pytest.approx(1000 / 0.4)
    assert found["limit_bytes_per_s"] == pytest.approx(1000 / 0.4 * 900)
    assert found["limit_of_the_thread_samples_per_s"] == pytest.approx(1000 / 0.2)
    assert found["limit_of_the_thread_bytes_per_s"] == pytest.approx(1000 / 0.2 * 900)
