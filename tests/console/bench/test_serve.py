"""The service's bench: ratios by hand, and a checkpoint that can be served."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from console.bench import serve
from console.run.experiment import PRESETS
from console.serving import loading


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
        pytest.raises(serve.BenchError, match="ended before it was done"),
    ):
        serve._line(process, may_end=True)
