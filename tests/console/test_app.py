"""The command line's own rules: what a run begins from, exit codes, and one line for an error."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from console import app
from console.run.directory import RunDirectory
from console.run.experiment import PRESETS, to_json
from rpc.errors import RpcError
from world import surroundings
from world.errors import ChoiceError, ConfigError, InhabitError


def test_values_of_flags() -> None:
    words = ["train", "--run", "a", "--preset=paper", "--last"]
    assert app.value_of(words, "--run") == "a"
    assert app.value_of(words, "--preset") == "paper"
    assert app.value_of(words, "--last") is None and app.value_of(words, "--none") is None


def test_exit_codes_separate_usage_errors_from_failures() -> None:
    assert app.exit_code(ChoiceError("task", "fly", ["sit"])) == 2
    assert app.exit_code(ConfigError("no")) == 2
    assert [app.exit_code(e) for e in (InhabitError("x"), RpcError("x"), KeyError("x"))] == [1] * 3


def test_errors_are_one_line_and_unexpected_ones_say_their_type() -> None:
    assert app.one_line(InhabitError("a\n  b")) == "a b"
    assert app.one_line(InhabitError()) == "InhabitError"
    assert app.one_line(FileNotFoundError(2, "No such file or directory", "/a/b")) == (
        "/a/b: No such file or directory (--debug shows where)"
    )
    assert app.one_line(ValueError("x")) == "ValueError: x (--debug shows where)"


@pytest.mark.parametrize(
    ("raised", "code"),
    [(KeyboardInterrupt(), 130), (SystemExit(3), 3), (SystemExit(None), 0), (SystemExit("x"), 1),
     (ConfigError("x"), 2), (ZeroDivisionError("x"), 1)],
)  # fmt: skip
def test_however_a_command_ends_there_is_a_code(
    raised: BaseException, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(command: Any) -> int:
        raise raised

    monkeypatch.setattr(app, "run", run)
    assert app.main(["motions", "list"]) == code


def test_a_resumed_run_goes_on_with_its_own_settings(tmp_path: Path) -> None:
    assert app.starting_point(["train", "sit", "--preset", "paper"]).ppo.hidden == (1024, 512)
    assert app.starting_point(["train", "--preset", "none"]).ppo.hidden == (512, 256)
    missing = ["train", "sit", "--resume", "--run", str(tmp_path)]
    assert app.starting_point(missing).ppo.hidden == (512, 256)


def test_an_opengl_that_is_not_there_is_said_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(surroundings, "missing_gl", surroundings.MissingGl("glx", "no display"))
    assert app.main(["objects", "list", "test", "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.err == "inhabit: MUJOCO_GL=glx is not there (no display): ignored\n"
    assert json.loads(captured.out)


@pytest.mark.parametrize("on", [True, False])
def test_a_script_may_repeat_its_flags_when_it_resumes(on: bool, tmp_path: Path) -> None:
    """Both of a pair of flags are taken, whatever the run's settings are; the help shows one."""
    settings = replace(PRESETS["fast"], lag=replace(PRESETS["fast"].lag, overlap=on))
    RunDirectory(tmp_path).write_config({"experiment": to_json(settings)})
    words = ["train", "sit", "--resume", "--run", str(tmp_path)]
    for flag, wanted in (("--lag.overlap", True), ("--lag.no-overlap", False)):
        assert app.parse([*words, flag]).experiment.lag.overlap is wanted
    assert app.parse(words).experiment.lag.overlap is on
