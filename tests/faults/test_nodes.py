"""A node of a Ray cluster goes without a word and another comes: the same bits, and work for it."""

import os
import time
from collections.abc import Iterator
from typing import Any

import pytest
import ray
from ray.cluster_utils import Cluster

from actors.cluster import START_S, on_loopback, ray_session, startup_timeouts
from actors.fleet import FleetConfig, RayFleet
from actors.local import LocalFleet
from policy.rollout import Rollout
from tests.support.faulty_shard import MakePoints
from tests.support.learning.fleets import (
    BLOCK,
    HORIZON,
    SCENES,
    SIGMA,
    assert_same,
    run,
    weights,
)
from tests.support.paths import ROOT

ROLLOUTS = 6
NODE = {"object_store_memory": 80 * 2**20, "node_ip_address": "127.0.0.1"}


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A head without a slot for actors and two nodes of one slot each, all on this machine."""
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    head = NODE | {"num_cpus": 0, "include_dashboard": False}
    with on_loopback(), startup_timeouts(START_S):
        made = Cluster(initialize_head=True, head_node_args=head)
        try:
            yield made
        finally:
            ray.shutdown()
            made.shutdown()


def undisturbed() -> list[Rollout]:
    fleet = LocalFleet(MakePoints(), SCENES, BLOCK, 1, seed=5, horizon=HORIZON)
    rollouts = [fleet.collect(weights(v), v, SIGMA) for v in range(ROLLOUTS)]
    fleet.close()
    return rollouts


def test_a_node_is_lost_and_another_added(cluster: Any) -> None:
    nodes = [cluster.add_node(num_cpus=1, **NODE) for _ in range(2)]
    config = FleetConfig(start_s=120, rollout_s=600, restarts=2)
    with ray_session(cpus=0, address=cluster.address):
        fleet = RayFleet(MakePoints(), SCENES, BLOCK, 2, 5, HORIZON, config)
        first = fleet.pids()
        got = [fleet.collect(weights(v), v, SIGMA) for v in range(2)]
        cluster.remove_node(nodes[1], allow_graceful=False)
        # Nobody has told the fleet, and its second actor has no slot to start on again.
        got += run(fleet, range(2, ROLLOUTS))
        assert_same(got, undisturbed())
        until = time.monotonic() + 120
        while fleet.alive() == 2:
            assert time.monotonic() < until, "Ray must tell of the lost node"
            fleet.collect(weights(ROLLOUTS), ROLLOUTS, SIGMA)
            time.sleep(0.2)
        assert sorted(fleet.division()) == [0, SCENES]
        survivor = fleet.division().index(SCENES)
        cluster.add_node(num_cpus=1, **NODE)
        while 0 in fleet.division():
            assert time.monotonic() < until + 120, "the replacement must start on the new node"
            fleet.collect(weights(ROLLOUTS), ROLLOUTS, SIGMA)
            time.sleep(0.2)
        assert fleet.alive() == 2 and fleet.restarts >= 1, (
            "more, where Ray tried the lost node again"
        )
        now = fleet.pids()
        assert now[survivor] == first[survivor] and now[1 - survivor] not in first
        assert not os.path.exists(f"/proc/{first[1 - survivor]}")
        fleet.close()
