"""`inhabit bench serve`: the policy service against a gRPC echo and Ray Serve, in one run."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from console.bench.serve_client import STREAMS
from console.run import assembly
from console.run.experiment import Experiment, to_json
from console.terminal import progress
from policy.checkpoints.format import Manifest, write
from world.errors import InhabitError

#: Goals: ratio to the echo's rate, ratio to Ray Serve's, and p99 at 256 streams, ms.
GOALS = {"echo": 0.6, "ray": 5.0, "p99_ms": 10.0}
#: Greatest ratio of the characters' p99 while another client floods to that without it.
FAIR_RATIO = 3.0
FLOODS = ("rows", "poses")


class BenchError(InhabitError):
    """A server or client process of the benchmark that failed."""


def measure(
    experiment: Experiment, seconds: float, note: Callable[[str], None] = print
) -> dict[str, float]:
    """Return all figures; those of Ray Serve are left out if it is missing or does not start.

    note: receives one line on a part that is left out.
    """
    figures: dict[str, float] = {}
    count = 2 * (4 + len(STREAMS)) + 2 * _has_ray_serve() + 1 + len(FLOODS)
    with (
        progress("measurements", count) as so_far,
        tempfile.TemporaryDirectory() as folder,
    ):
        done = iter(range(1, count + 1))

        def measured() -> None:
            so_far(next(done, count))

        checkpoint = _checkpoint(experiment, Path(folder))
        for kind in ("echo", "policy", "ray"):
            if kind == "ray" and not _has_ray_serve():
                note("Ray Serve: not measured; install it by pip install 'inhabit[bench]'")
                continue
            try:
                found = _of(kind, checkpoint, seconds, measured)
            except BenchError as error:
                if kind != "ray":
                    raise
                note(f"Ray Serve: not measured: {error}")
                continue
            figures |= {f"{kind}_{name}": value for name, value in found.items()}
        figures |= _fairness(checkpoint, seconds, measured)
    return figures | _ratios(figures)


def _fairness(checkpoint: Path, seconds: float, measured: Callable[[], None]) -> dict[str, float]:
    """Return the latencies of a few characters alone, and while another client asks for as much as
    it may: in rows of observations, or in situations."""
    found: dict[str, float] = {}
    with _process("servers", "policy", str(checkpoint)) as server:
        address = str(_line(server)["address"])
        for flood in (None, *FLOODS):
            with ExitStack() as stack:
                if flood is not None:
                    words = (address, "0", f"flood-{flood}")
                    _line(stack.enter_context(_process("client", *words)))
                watched = stack.enter_context(_process("client", address, str(seconds), "paced"))
                line = _line(watched)
                _send_line(watched)
                measured()
            name = "alone" if flood is None else f"flood_{flood}"
            found |= {f"fair_{name}_{unit}": float(line[unit]) for unit in ("p50_ms", "p99_ms")}
    return found | _fair_ratios(found)


def _fair_ratios(figures: dict[str, float]) -> dict[str, float]:
    """Return how much longer the characters wait at p99 for each flood, the limit, and whether all
    are within it (1) or not (0)."""
    ratios = {
        f"fair_flood_{flood}_p99_ratio": figures[f"fair_flood_{flood}_p99_ms"]
        / figures["fair_alone_p99_ms"]
        for flood in FLOODS
    }
    within = all(ratio <= FAIR_RATIO for ratio in ratios.values())
    return ratios | {"limit_fair_p99_ratio": FAIR_RATIO, "fair_within_limit": float(within)}


def _ratios(figures: dict[str, float]) -> dict[str, float]:
    """Return the ratios of our calls/s and calls per processor second to those of the others."""
    found = {}
    for name in ("act_64", "control_64"):
        for unit in ("per_s", "per_processor_s"):
            ours, echo = figures[f"policy_{name}_{unit}"], figures[f"echo_{name}_{unit}"]
            found[f"{name}_{unit}_to_echo_ratio"] = ours / echo
            ray = figures.get(f"ray_act_64_{unit}")
            if ray:
                found[f"{name}_{unit}_to_ray_ratio"] = ours / ray
    return found | {
        "goal_to_echo_ratio": GOALS["echo"],
        "goal_to_ray_ratio": GOALS["ray"],
        "goal_streams_256_p99_ms": GOALS["p99_ms"],
    }


def _of(
    kind: str, checkpoint: Path, seconds: float, measured: Callable[[], None]
) -> dict[str, float]:
    """Return the figures of one server, with its processor time over each measurement."""
    figures: dict[str, float] = {}
    with _process("servers", kind, str(checkpoint)) as server:
        address = str(_line(server)["address"])
        words = [address, str(seconds)] + (["unary"] if kind == "ray" else [])
        with _process("client", *words) as client:
            before = _spent(server)
            while line := _line(client, may_end=True):
                after = _spent(server)
                measured()
                name = line.pop("name")
                for unit, value in line.items():
                    figures[f"{name}_{unit}"] = float(value)
                used = max(after - before, 1e-9)
                figures[f"{name}_per_processor_s"] = float(line["per_s"]) * seconds / used
                before = after
                _send_line(client)
    return figures


@contextmanager
def _process(part: str, *words: str) -> Iterator["subprocess.Popen[str]"]:
    environment = dict(os.environ, OMP_NUM_THREADS="1", CUDA_VISIBLE_DEVICES="")
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    process = subprocess.Popen(
        [sys.executable, "-m", f"console.bench.serve_{part}", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    try:
        yield process
    finally:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.close()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()


def _line(process: "subprocess.Popen[str]", may_end: bool = False) -> dict[str, str | float]:
    """Return the next JSON object that a process prints; other lines are skipped."""
    assert process.stdout is not None
    for line in process.stdout:
        if line.startswith("{"):
            return json.loads(line)
    if may_end and process.wait(20) == 0:
        return {}
    raise BenchError("a server or client of the benchmark ended early; see above")


def _send_line(process: "subprocess.Popen[str]") -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def _spent(server: "subprocess.Popen[str]") -> float:
    _send_line(server)
    return float(_line(server)["processor_s"])


def _checkpoint(experiment: Experiment, folder: Path) -> Path:
    """Write a checkpoint of the experiment's size with random weights."""
    student = assembly.learner(experiment)
    notes = {"experiment": json.dumps(to_json(experiment)), "data": "none: random weights"}
    manifest = Manifest(assembly.layout(experiment), 0, 0, notes)
    path = write(folder / "000000", {"policy": student.policy_state()}, manifest)
    student.close()
    return path


def _has_ray_serve() -> bool:
    try:
        import ray.serve  # noqa: F401
    except ImportError:
        return False
    return True
