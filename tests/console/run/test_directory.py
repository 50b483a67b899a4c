"""Run directories, the metrics file and the display's figures."""

import datetime
from pathlib import Path

import pytest

from console.run.directory import RunDirectory, RunError, checkpoint_folder, new_run, policy_source


def test_new_runs_count_up(tmp_path):
    day = datetime.date(2026, 11, 23)
    first = new_run("sit", tmp_path, day)
    assert first.path.name == "sit-2026-11-23-1"
    first.create()
    assert new_run("sit", tmp_path, day).path.name == "sit-2026-11-23-2"


def test_a_run_is_locked_once(tmp_path):
    run = RunDirectory(tmp_path / "r")
    with run.lock(), pytest.raises(RunError, match="in use"), run.lock():
        pass
    with run.lock():
        pass


def test_unwritable_run_says_so(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunError, match="cannot make run directory"):
        RunDirectory(tmp_path / "file" / "run").create()


def test_checkpoint_is_found_from_a_run_and_from_itself(tmp_path):
    folder = tmp_path / "run" / "checkpoints" / "000010"
    folder.mkdir(parents=True)
    (folder / "manifest.json").write_text("{}")
    (folder.parent / "latest").symlink_to("000010")
    for where in (tmp_path / "run", folder, folder.parent / "latest"):
        assert checkpoint_folder(where) == folder
    # a training that resumes has the teacher with which it began, not a later one
    assert policy_source(str(tmp_path / "run")) == str(folder)
    assert policy_source("walk") == "walk" and policy_source("") == ""
    with pytest.raises(RunError, match="does not exist"):
        checkpoint_folder(tmp_path / "none")
    (tmp_path / "empty").mkdir()
    with pytest.raises(RunError, match="no checkpoint"):
        checkpoint_folder(tmp_path / "empty")


@pytest.mark.parametrize("content", ["5", "[]", "null", '"a"'])
def test_settings_that_are_no_object_are_refused(tmp_path: Path, content: str) -> None:
    (tmp_path / "config.json").write_text(content)
    with pytest.raises(RunError, match=r"config.json holds no object of settings"):
        RunDirectory(tmp_path).read_config()


def test_settings_that_are_no_file_are_not_opened(tmp_path: Path) -> None:
    (tmp_path / "config.json").symlink_to("/dev/zero")
    with pytest.raises(
        RunError, match=r"cannot read .*config.json: a pipe or a device, not a file"
    ):
        RunDirectory(tmp_path).read_config()
