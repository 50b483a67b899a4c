"""A real `inhabit train` that is SIGKILLed at random moments and resumed, against one that is not.

`python -m tests.support.kill_learner --kills 50` prints what came of it as JSON.
"""

import argparse
import json
import multiprocessing
import os
import random
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import torch

from console.app import main as inhabit
from console.run.metrics import read_metrics
from policy.checkpoints.format import flatten, read
from tests.support import small_clips

CHECKPOINT_EVERY = 3
#: Of time and of how many workers there were; everything else must be the same.
TIMED = ("rate/", "seconds", "actors/")


@dataclass
class Outcome:
    """What was seen over all lives of one training."""

    kills: int = 0
    before_the_first_iteration: int = 0
    while_a_checkpoint_was_written: int = 0
    iterations_done_again: int = 0
    metrics_lines: int = 0
    samples: int = 0
    tensors_compared: int = 0
    left_processes: int = 0
    slowest_recovery_s: float = 0.0
    """From starting `--resume` to the first new line of metrics."""


def flags(clips: Path) -> list[str]:
    """A training of 64 samples an iteration on tiny networks."""
    return [
        "--motions", str(clips), "--scenes", "16", "--block", "8", "--horizon", "4",
        "--world.pieces", "2", "--world.scales", "1", "--world.episode-s", "0.5",
        "--ppo.hidden", "32", "16", "--ppo.warmup-iterations", "1", "--style.hidden", "32", "16",
        "--style.batch", "32", "--style.penalty-batch", "16", "--style.normaliser-samples", "500",
        "--style.replay", "1000", "--clone-passes", "0", "--threads", "1",
        "--checkpoint-every", str(CHECKPOINT_EVERY), "--preset", "fast",
    ]  # fmt: skip


def started(run: Path, iterations: int, more: list[str]) -> ForkServerProcess:
    """`inhabit train` of a run in a process of its own, which need not import torch again."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["tests.support.kill_learner", "console.training.command"])
    words = ["train", "sit", "--run", str(run), "--iterations", str(iterations), *more]
    process = context.Process(target=_train, args=(words, run.parent / f"{run.name}.err"))
    process.start()
    return process


def _train(words: list[str], said: Path) -> None:
    """In that process: as the command is, its output in a file."""
    os.setsid()
    with said.open("ab") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    sys.exit(inhabit(words))


def finish(run: Path, iterations: int, more: list[str]) -> None:
    """Run it to its end; RuntimeError with what it said if it fails."""
    process = started(run, iterations, more)
    process.join()
    if process.exitcode:
        raise RuntimeError((run.parent / f"{run.name}.err").read_text()[-2000:])


def killed_and_resumed(
    folder: Path, kills: int, iterations: int, seed: int, more: list[str]
) -> Outcome:
    """Kill and resume `folder/killed` so often, let it end, compare it with `folder/whole`."""
    base = [*flags(small_clips.write(folder / "clips")), *more]
    draw, outcome = random.Random(seed), Outcome()
    finish(folder / "whole", iterations, base)
    run = folder / "killed"
    while outcome.kills < kills:
        process = started(run, iterations, [*base, onwards(run)])
        began, before = time.monotonic(), None
        # A few iterations, and then any moment within the next ones.
        wait_for, rest_s = draw.choice([0, 1, 2, 4, 7]), draw.uniform(0, 0.3)
        while process.is_alive():
            lines = len(read_metrics(run / "metrics.jsonl"))
            if before is None or lines < before:
                before = lines  # resuming drops the lines after the checkpoint
            if lines > before:
                taken = time.monotonic() - began
                outcome.slowest_recovery_s = max(outcome.slowest_recovery_s, taken)
            if lines >= before + wait_for and time.monotonic() - began > 0.5:
                break
            time.sleep(0.005)
        time.sleep(rest_s if wait_for else draw.uniform(0, 8))
        if not process.is_alive():
            break  # it came to its end first
        family = descendants(process.pid or 0)
        process.kill()
        process.join()
        outcome.kills += 1
        lines = len(read_metrics(run / "metrics.jsonl"))
        outcome.before_the_first_iteration += lines <= before
        outcome.while_a_checkpoint_was_written += any(run.glob("checkpoints/.*.partial"))
        outcome.iterations_done_again += lines % CHECKPOINT_EVERY
        outcome.left_processes += still_there(family, within_s=90)
    finish(run, iterations, [*base, onwards(run)])
    compare(folder / "whole", run, outcome)
    return outcome


def onwards(run: Path) -> str:
    """The flag that goes on with a run: before its first checkpoint there is nothing to resume."""
    return "--resume" if (run / "checkpoints" / "latest").is_symlink() else "--restart"


def compare(whole: Path, run: Path, outcome: Outcome) -> None:
    """AssertionError where weights, states or metrics differ in a bit."""
    one, other = (read(r / "checkpoints" / "latest").state for r in (whole, run))
    (tensors, values), (wanted, said) = flatten(other), flatten(one)
    assert tensors.keys() == wanted.keys()
    differing = [k for k, v in wanted.items() if not torch.equal(v, tensors[k])]
    assert not differing, differing
    assert {k: v for k, v in values.items() if k != "training/seconds"} == {
        k: v for k, v in said.items() if k != "training/seconds"
    }
    lines, undisturbed = (read_metrics(r / "metrics.jsonl") for r in (run, whole))
    assert [line["iteration"] for line in lines] == list(range(1, len(undisturbed) + 1))
    for line, wanted_line in zip(lines, undisturbed, strict=True):
        assert numbers(line) == numbers(wanted_line), line["iteration"]
    outcome.metrics_lines, outcome.samples = len(lines), lines[-1]["samples"]
    outcome.tensors_compared = len(wanted)


def numbers(line: dict[str, float]) -> dict[str, float]:
    """A line of metrics without what is of time."""
    return {k: v for k, v in line.items() if not k.startswith(TIMED)}


def descendants(pid: int) -> set[int]:
    """Of a process, at this moment."""
    parents: dict[int, int] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue  # it has ended
    known = {pid}
    while found := {p for p, parent in parents.items() if parent in known} - known:
        known |= found
    return known - {pid}


def still_there(pids: set[int], within_s: float) -> int:
    """How many are left after so long, zombies apart."""
    until = time.monotonic() + within_s
    while True:
        left = {p for p in pids if _runs(p)}
        if not left or time.monotonic() > until:
            return len(left)
        time.sleep(0.1)


def _runs(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--iterations", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--runner", default="local")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        more = ["--runner", asked.runner]
        found = killed_and_resumed(Path(folder), asked.kills, asked.iterations, asked.seed, more)
    print(json.dumps(asdict(found), indent=1))


if __name__ == "__main__":
    main()
