"""`inhabit bench endurance`: memory of each process, and of the object store, over a training."""

import os
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from console.commands import Train
from console.run import machine
from console.run.directory import RunDirectory
from console.run.experiment import Experiment
from console.run.metrics import read_metrics
from console.terminal import INTERRUPTED
from console.training.command import train

#: Time in which memory may settle, s; a third of a shorter measurement.
WARM_UP_S = 600.0
#: Iterations between checkpoints, which must not leak either.
CHECKPOINT_EVERY = 50


@dataclass(frozen=True)
class Sample:
    """Resident memory of every process of a training at one moment."""

    at_s: float
    resident_mb: dict[int, float]
    object_store_mb: float


def measure(experiment: Experiment, runner: str, threads: int, seconds: float) -> dict[str, float]:
    """Train for a time in a temporary directory and sample the memory of all processes.

    Return MB of each process after warm-up and at the end, and their ratio; see `figures`.
    """
    with tempfile.TemporaryDirectory() as folder:
        run = RunDirectory(Path(folder) / "run")
        command = Train(
            task=experiment.world.task,
            experiment=replace(experiment, clone_passes=0),  # cloning would end before sampling
            run=run.path,
            minutes=seconds / 60,
            runner="ray" if runner == "ray" else "local",
            threads=threads,
            checkpoint_every=CHECKPOINT_EVERY,
        )
        watch = Watch(max(0.2, min(5.0, seconds / 60)))
        try:
            code = train(command)
        finally:
            samples = watch.stop()
        if code == INTERRUPTED:
            raise KeyboardInterrupt  # training has answered it; there is nothing to measure
        lines = read_metrics(run.metrics)
    counts = {"iterations": float(len(lines)), "samples": float(lines[-1]["samples"])}
    return counts | figures(samples, watch.names)


def figures(samples: list[Sample], names: dict[int, str]) -> dict[str, float]:
    """Return medians over a tenth of the time, after warm-up and at the end.

    Processes in all of these samples count; those that started or ended are counted apart.
    """
    # processes end in the last moments
    whole = samples[-1].at_s
    warm = min(WARM_UP_S, whole / 3)
    first = [s for s in samples if warm <= s.at_s < warm + (whole - warm) / 10]
    last = [s for s in samples if 0.88 * whole <= s.at_s < 0.98 * whole]
    if not first or not last:
        raise ValueError(f"{len(samples)} samples in {whole:.1f} s are too few")
    found = {"seconds": whole, "warm_up_s": warm}
    seen = [set(s.resident_mb) for s in samples if s.at_s >= warm and s.at_s < 0.98 * whole]
    steady = set.intersection(*seen)
    for pid in sorted(steady, key=lambda pid: names[pid]):
        before = median(s.resident_mb[pid] for s in first)
        after = median(s.resident_mb[pid] for s in last)
        name = names[pid]
        found[f"{name}_warm_mb"] = before
        found[f"{name}_end_mb"] = after
        found[f"{name}_growth_ratio"] = after / before
    found["processes_begun_or_ended"] = float(len(set.union(*seen) - steady))
    found["object_store_warm_mb"] = median(s.object_store_mb for s in first)
    found["object_store_end_mb"] = median(s.object_store_mb for s in last)
    found["object_store_most_mb"] = max(s.object_store_mb for s in samples)
    return found


class Watch:
    """Samples the memory of this process and all its descendants in a thread until `stop`."""

    def __init__(self, every_s: float) -> None:
        self.names: dict[int, str] = {}
        self._every_s = every_s
        self._samples: list[Sample] = []
        self._began = time.monotonic()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> list[Sample]:
        """Stop sampling; return the samples."""
        self._stopping.set()
        self._thread.join()
        kinds: Counter[str] = Counter()
        for pid in sorted(self.names):
            kind = self.names[pid]
            self.names[pid] = f"{kind}_{kinds[kind]}"
            kinds[kind] += 1
        return self._samples

    def _run(self) -> None:
        while not self._stopping.wait(self._every_s):
            resident = {pid: 1e3 * machine.resident_gb(pid) for pid in machine.process_tree()}
            resident = {pid: size for pid, size in resident.items() if size}
            for pid in resident:
                self.names.setdefault(pid, kind_of(pid))
                if self.names[pid] == "worker":  # a Ray worker without a task so far
                    self.names[pid] = kind_of(pid)
            at = time.monotonic() - self._began
            self._samples.append(Sample(at, resident, object_store_mb()))


def kind_of(pid: int) -> str:
    """Return the role of a process in a training, by its command line."""
    try:
        words = Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ").split()
    except (OSError, UnicodeDecodeError):
        words = []
    line = " ".join(words)
    if pid == os.getpid():
        return "learner"
    if "discriminator.process" in line:
        return "style"
    if line.startswith("ray::"):
        return "actor" if "RolloutActor" in line else "worker"
    if "multiprocessing.spawn" in line:
        return "actor"
    program = Path(words[0]).name if words else "process"
    scripts = [Path(word) for word in words[1:] if word.endswith(".py")]
    if not program.startswith("python") or not scripts:
        return program
    return f"{scripts[0].parent.name}_{scripts[0].stem}"


def object_store_mb() -> float:
    """Return the size of objects in Ray's object store on all nodes, MB; 0 without Ray."""
    import ray

    if not ray.is_initialized():
        return 0.0
    key = "object_store_memory"
    try:
        held = ray.cluster_resources().get(key, 0.0) - ray.available_resources().get(key, 0.0)
    except Exception:  # Ray raises various errors while it starts or stops
        return 0.0
    return held / 1e6
