"""Memory over a training, from samples made by hand."""

import os

import pytest

from console.bench import endurance
from console.bench.endurance import Sample, Watch, figures
from console.run.experiment import PRESETS
from console.terminal import INTERRUPTED


def test_growth_is_between_the_medians_of_two_tenths() -> None:
    """A hundred seconds: warm after 33.3; one process grows by a quarter, one comes and goes."""
    samples = []
    for second in range(101):
        resident = {1: 100.0 if second < 60 else 125.0, 2: 50.0}
        if 40 < second < 50:
            resident[3] = 10.0
        samples.append(Sample(float(second), resident, object_store_mb=float(second == 70)))
    found = figures(samples, {1: "main_0", 2: "actor_0", 3: "actor_1"})
    assert found["main_0_warm_mb"] == 100.0 and found["main_0_end_mb"] == 125.0
    assert found["main_0_growth_ratio"] == 1.25 and found["actor_0_growth_ratio"] == 1.0
    assert "actor_1_end_mb" not in found and found["processes_begun_or_ended"] == 1.0
    assert found["object_store_end_mb"] == 0.0 and found["object_store_most_mb"] == 1.0
    assert found["warm_up_s"] == pytest.approx(100 / 3)


def test_too_few_samples_are_said() -> None:
    with pytest.raises(ValueError, match="are too few"):
        figures([Sample(1.0, {1: 1.0}, 0.0)], {1: "main_0"})


def test_a_watch_sees_this_process() -> None:
    watch = Watch(0.01)
    while not watch._samples:
        pass
    samples = watch.stop()
    assert samples[0].resident_mb[os.getpid()] > 10.0
    assert watch.names[os.getpid()].endswith("_0")


def test_an_interrupted_training_is_no_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    """Training answers Ctrl-C itself and returns; it may have no iteration to measure by then."""
    monkeypatch.setattr(endurance, "train", lambda _command: INTERRUPTED)
    with pytest.raises(KeyboardInterrupt):
        endurance.measure(PRESETS["fast"], "local", 1, 1.0)
