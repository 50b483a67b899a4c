"""`inhabit motions check`: what each line, the table and the summary say."""

from dataclasses import replace
from pathlib import Path

import pytest

from console.commands import MotionsCheck
from console.motions import check
from console.motions.measures import examine, refusal
from tests.support import small_clips
from world.motions import load


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small_clips.write(tmp_path_factory.mktemp("clips"))


def test_a_bad_file_is_reported_and_the_others_measured(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.npz"
    bad.write_bytes(b"nothing")
    assert check.check_command(MotionsCheck((bad, folder))) == 1
    said = capsys.readouterr().out
    assert "bad: " in said and "3 clips" in said and "1 refused" in said
    assert check.check_command(MotionsCheck((folder,))) == 0


def test_remarks_are_what_the_table_has_no_room_for(folder: Path) -> None:
    report = examine(load.read(sorted(folder.glob("*.npz"))[0]))
    report = replace(report, discontinuities=[1.25, 2.0], past_limits=0.25, past_limits_deg=12.3,
                     past_limits_joint="left_knee")  # fmt: skip
    assert check.remarks(report) == [
        "breaks at 1.25 s, 2.00 s",
        "left_knee is past its range by up to 12 degrees; some joint is in 25 % of the frames",
    ]
    assert check.remarks(refusal("x", "torn")) == ["torn"]


def test_means_are_over_time(folder: Path) -> None:
    one = examine(load.read(sorted(folder.glob("*.npz"))[0]))
    long = replace(one, seconds=3.0, key_body_error_m=0.01, verdict="good")
    short = replace(one, seconds=1.0, key_body_error_m=0.05, verdict="poor")
    said = check.summary([long, short, refusal("x", "torn")])
    assert said.startswith("3 clips, 4 s: 1 good, 0 fair, 1 poor, 1 refused; hands and feet 2.0 cm")
    assert check.summary([refusal("x", "torn")]) == "1 clip, none usable"
