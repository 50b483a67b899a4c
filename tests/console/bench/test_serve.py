"""The service's bench: ratios by hand, and a checkpoint that can be served."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from console.bench import serve
from console.bench.serve_client import flood_of
from console.run.experiment import PRESETS
from console.serving import loading
from policy.config import PolicyServiceConfig
from policy.messages import requests
from rpc.v1 import policy_pb2 as pb


def test_ratios_by_hand() -> None:
    figures = {
        f"{kind}_{name}_{unit}": value
        for kind, value in (("policy", 600.0), ("echo", 1000.0), ("ray", 100.0))
        for name in ("act_64", "control_64")
        for unit in ("per_s", "per_processor_s")
    }
    found = serve._ratios(figures)
    assert found["act_64_per_s_to_echo_ratio"] == found["goal_to_echo_ratio"] == 0.6
    assert found["control_64_per_processor_s_to_ray_ratio"] == 6.0
    without = {k: v for k, v in figures.items() if not k.startswith("ray")}
    assert not any("to_ray_ratio" in k for k in serve._ratios(without) if "goal" not in k)


def test_the_policy_of_the_bench_can_be_served(tmp_path: Path) -> None:
    experiment = PRESETS["fast"]
    experiment = replace(experiment, ppo=replace(experiment.ppo, hidden=(16,)))
    path = serve._checkpoint(experiment, tmp_path)
    assert loading.served("sit", path).check().task.name == "sit"


def test_lines_that_are_no_figures_are_passed_over() -> None:
    code = "print('started'); print('{\"per_s\": 3}')"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True
    ) as process:
        assert serve._line(process) == {"per_s": 3}
        assert serve._line(process, may_end=True) == {}
    with (
        subprocess.Popen(
            [sys.executable, "-c", "raise SystemExit(1)"], stdout=subprocess.PIPE, text=True
        ) as process,
        pytest.raises(serve.BenchError, match="ended early"),
    ):
        serve._line(process, may_end=True)


def test_fairness_by_hand() -> None:
    figures = {"fair_alone_p99_ms": 2.0, "fair_flood_rows_p99_ms": 6.0}
    found = serve._fair_ratios(figures | {"fair_flood_poses_p99_ms": 3.0})
    assert found["fair_flood_rows_p99_ratio"] == found["limit_fair_p99_ratio"] == 3.0
    assert found["fair_flood_poses_p99_ratio"] == 1.5 and found["fair_within_limit"] == 1.0
    found = serve._fair_ratios(figures | {"fair_flood_poses_p99_ms": 6.1})
    assert found["fair_within_limit"] == 0.0


@pytest.mark.parametrize("flood", serve.FLOODS)
def test_a_flood_is_a_call_that_the_service_takes(flood: str, tmp_path: Path) -> None:
    """Of the most rows or situations that it may have, so that it is no flood of refusals."""
    experiment = PRESETS["fast"]
    experiment = replace(experiment, ppo=replace(experiment.ppo, hidden=(16,)))
    served = loading.served("sit", serve._checkpoint(experiment, tmp_path))
    limits = PolicyServiceConfig()
    method, data = flood_of(f"flood-{flood}")
    if flood == "rows":
        request = pb.ActRequest.FromString(data)
        widths = (114, served.width - 114)
        _, rows = requests.observation(request.state, request.goal, widths, limits.max_rows)
        assert (method, rows) == ("Act", limits.max_rows)
    else:
        request = pb.ActFromPoseRequest.FromString(data)
        _, rows = requests.poses(request.situations, served.task)
        assert (method, rows) == ("ActFromPose", limits.max_poses)
