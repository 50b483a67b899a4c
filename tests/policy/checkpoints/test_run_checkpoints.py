"""The checkpoints of a run: which are kept, and which one is meant."""

import shutil

import pytest

from policy.checkpoints.format import read_manifest
from policy.checkpoints.numbering import numbered
from policy.checkpoints.run_checkpoints import RunCheckpoints, read_newest, resolve
from policy.errors import CheckpointError
from tests.support.learning.checkpoints import LAYOUT, state


def test_a_run_keeps_the_last_few_and_the_best(tmp_path):
    run = RunCheckpoints(tmp_path / "checkpoints", LAYOUT, keep=2)
    for iteration in (1, 2, 3, 4, 5):
        run.save(iteration, state(), best=iteration == 2)
    assert [p.name for p in numbered(run.directory)] == ["000002", "000004", "000005"]
    assert resolve(tmp_path).name == "000005"
    assert resolve(tmp_path / "checkpoints").name == "000005"
    assert resolve(tmp_path / "checkpoints" / "best").name == "000002"
    assert resolve(tmp_path / "checkpoints" / "000004").name == "000004"
    assert read_manifest(resolve(tmp_path)).iteration == 5
    with pytest.raises(CheckpointError, match="neither"):
        resolve(tmp_path / "nowhere")


def test_a_leftover_of_a_killed_writer_is_no_checkpoint(tmp_path):
    run = RunCheckpoints(tmp_path, LAYOUT)
    (tmp_path / ".000003.partial").mkdir()
    (tmp_path / ".000003.partial" / "policy.safetensors").write_bytes(b"half")
    run.save(2, state())
    assert resolve(tmp_path).name == "000002"
    run.save(3, state())
    assert resolve(tmp_path).name == "000003"
    assert not (tmp_path / ".000003.partial").exists()


def test_checkpoints_are_in_the_order_of_their_numbers(tmp_path):
    """Beyond 999,999 iterations, too, and with a copy that someone set aside beside them."""
    run = RunCheckpoints(tmp_path, LAYOUT, keep=2)
    run.save(999_998, state())
    copy = shutil.copytree(tmp_path / "999998", tmp_path / "999998-good")
    for iteration in (999_999, 1_000_000):
        run.save(iteration, state())
    assert [p.name for p in numbered(tmp_path)] == ["999999", "1000000"]
    assert copy.is_dir()
    # the newest is damaged: the one before it is read, not the copy
    (tmp_path / "1000000" / "manifest.json").write_text("{")
    found, errors = read_newest(tmp_path, lambda manifest: LAYOUT)
    assert found.manifest.iteration == 999_999 and len(errors) == 1
