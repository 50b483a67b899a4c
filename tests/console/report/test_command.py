"""The report: charts, poses and the page itself, which must need nothing but a browser."""

import base64
import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from console.app import main
from console.commands import Evaluate
from console.evaluation.scores import Protocol, judge
from console.evaluation.stepping import Track
from console.report import charts, page, scene3d
from console.report.charts import Line
from console.report.command import headline, order
from tests.console.recording.test_format import take
from tests.support.paths import ROOT
from world.furniture.catalogue import catalogue
from world.objects.furniture_bank import Bank


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_enclose_and_are_round(low: float, span: float) -> None:
    high = low + span
    found = charts.ticks(low, high)
    assert 2 <= len(found) <= 8
    slack = 1e-6 * (abs(low) + abs(high))
    assert found[0] <= low + slack and found[-1] >= high - slack


def test_ticks_and_labels_by_hand() -> None:
    assert charts.ticks(0.0, 1.0) == [0.0, 0.5, 1.0]
    assert charts.ticks(-0.3, 7.2) == [-2.0, 0.0, 2.0, 4.0, 6.0, 8.0]
    assert charts.decades(0.03, 4.0) == pytest.approx([0.01, 0.1, 1.0, 10.0])
    assert [charts.shown(x) for x in (0, 0.25, 1500, 2e6, 5e-5)] == [
        "0", "0.25", "1500", "2e6", "5e-5",
    ]  # fmt: skip


def test_a_chart_puts_points_where_they_belong() -> None:
    drawn = charts.chart("t & u", [Line("a", ((0.0, 0.0), (1.0, 1.0), (2.0, 0.5)))], "x")
    points = re.search(r'points="([^"]+)"', drawn)
    assert points is not None and "t &amp; u" in drawn
    xy = [tuple(map(float, p.split(","))) for p in points[1].split()]
    assert [x for x, _ in xy] == pytest.approx([46.0, 198.0, 350.0])
    assert [y for _, y in xy] == pytest.approx([180.0, 30.0, 105.0])
    assert charts.chart("none", [Line("a", ((0.0, 1.0),))], "x") == ""
    assert charts.chart("bad", [Line("a", ((0.0, -1.0), (1.0, 0.0)))], "x", True) == ""


def test_thinning_keeps_the_mean() -> None:
    points = tuple((float(i), float(i % 7)) for i in range(1001))
    thin = charts.thinned(points, 100)
    assert len(thin) == 100
    assert np.mean([y for _, y in thin]) == pytest.approx(np.mean([y for _, y in points]), abs=0.02)
    assert charts.thinned(((0.0, float("nan")), (1.0, 2.0))) == ((1.0, 2.0),)


def track() -> Track:
    shown = take(6)
    shown.qpos[:, 0] = np.linspace(0, 1, 6)
    model = Bank([catalogue("test", 1)[0].scaled(1.1)]).models[0]
    return Track(shown, np.zeros((6, 114), np.float32), np.linspace(1, 0.5, 6), model, 6)


def test_the_viewer_gets_the_simulators_poses() -> None:
    shown = track()
    data = scene3d.drawable(shown)
    raw = np.frombuffer(base64.b64decode(data["poses"]), "<i2")
    poses = raw.reshape(6, data["bodies"], 7)
    model, state = shown.model, mujoco.MjData(shown.model)
    state.qpos[:] = shown.take.qpos[3]
    state.mocap_pos[0] = shown.take.mocap_pos[3]
    mujoco.mj_forward(model, state)
    for shape in data["shapes"]:
        assert shape["kind"] in ("sphere", "capsule", "box")
    root = poses[3, data["root"]]
    assert root[:3] / 1000 == pytest.approx(state.xpos[1], abs=6e-4)
    assert root[3:] / 32767 == pytest.approx(state.xquat[1], abs=4e-5)
    # every visible geom stands where body pose and local pose put it
    place = next(s for s in data["shapes"] if s["kind"] == "sphere" and s["size"][0] == 0.095)
    at = poses[3, place["body"]]
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, at[3:] / 32767)
    head = at[:3] / 1000 + rotation.reshape(3, 3) @ place["pos"]
    assert head == pytest.approx(state.geom("head").xpos, abs=2e-3)
    used = len(shown.take.boxes)
    assert sum(shape["kind"] == "box" for shape in data["shapes"]) == used + 2  # and two feet


def test_trials_are_ranked_by_what_counts() -> None:
    protocol = Protocol(success_m=0.2, limit_s=1.0, hold_s=0.2, control_hz=10)
    error = np.ones((5, 12), np.float32)
    error[0, 3:] = 0.1  # sustained, late
    error[1, 1:] = 0.1  # sustained, soon
    error[2, 5] = 0.1  # touched
    error[3, 5] = 0.4  # near
    fell = np.array([12, 12, 12, 12, 3])
    assert order(judge(error, fell, protocol), error) == [1, 0, 2, 3, 4]


def test_the_headline_is_of_the_largest_evaluation_of_this_checkpoint() -> None:
    own = {"iteration": 5, "perturbation": "none", "start_m": [1, 10], "objects": "test"}
    own["trials"] = 96
    more = own | {"trials": 4096}
    others = [own | {"trials": 9999, key: 0} for key in ("iteration", "start_m", "objects")]
    others.append(own | {"trials": 9999, "perturbation": "moved"})
    assert headline([*others, more], own) is more
    assert headline(others, own) is own


def test_a_report_is_one_file_that_needs_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def short(**fields: float) -> Protocol:
        return Protocol(**{**fields, "limit_s": 1.0, "hold_s": 0.2})

    for module in ("console.evaluation.command", "console.report.command"):
        monkeypatch.setattr(f"{module}.Protocol", short)
    monkeypatch.setattr("console.report.pictures.can_draw", lambda: False)
    monkeypatch.setattr("console.evaluation.command.assembly.library_of", lambda world: None)
    out = tmp_path / "report.html"
    policy = str(ROOT / "pretrained" / "sit")
    assert main(["report", policy, "--trials", "3", "--out", str(out), "--perturb", "moved"]) == 0
    text = out.read_text()
    assert len(text) < 5e6
    # nothing is fetched: no address, no file, no module
    assert not re.search(r"https?://|<link|\bsrc=\"(?!data:)|\bimport\b.*from|url\(", text)
    takes = re.search(r'id="takes">(.*?)</script>', text, re.S)
    assert takes is not None
    data = json.loads(takes[1])
    assert len(data) == 3 and all(one["frames"] >= 2 for one in data)
    for heading in ("By stage", "By distance", "By object", "Motion quality", "Training"):
        assert f"<h2>{heading}" in text
    assert "90.4" in text or "87.5" in text  # the paper's row
    assert str(tmp_path) not in text and "/work" not in text and str(Path.home()) not in text
    assert main(["report", policy, "--trials", "2"]) == 2
    assert "at least 3" in capsys.readouterr().err


def test_text_in_the_page_is_escaped() -> None:
    table = page.table(("<b>", "n"), [("a&b", "<script>")])
    assert "<script>" not in table and "&lt;b&gt;" in table and "a&amp;b" in table
    assert Evaluate(Path("x")).quality > 0
