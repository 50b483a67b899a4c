"""The rate that this machine trains at is measured."""

import pytest

from console.app import parse


def test_a_rate_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    from console.doctor import rate as doctor_rate
    from console.run.experiment import PRESETS

    monkeypatch.setitem(PRESETS, "fast", parse(["train", "sit", "--scenes", "64"]).experiment)
    monkeypatch.setattr(doctor_rate, "PIECES", 2)
    monkeypatch.setattr(doctor_rate, "cores", lambda: 1)
    finding = doctor_rate.estimate(0.1)
    rate = float(finding.detail.split(" samples/s")[0].replace(",", ""))
    assert finding.verdict == "ok" and rate > 10
