"""Checkpoints come back bit for bit, or with one clear error."""

import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from policy.checkpoints.format import read, read_manifest, write
from policy.errors import CheckpointError, LayoutError
from tests.support.learning.checkpoints import LAYOUT, MANIFEST, assert_same, state
from tests.support.paths import ROOT


def test_comes_back_exactly(tmp_path):
    path = write(tmp_path / "000012", state(), MANIFEST)
    back = read(path, layout=LAYOUT)
    assert_same(back.state, state())
    assert back.manifest == MANIFEST == read_manifest(path)
    assert {p.name for p in path.iterdir()} == {
        "policy.safetensors",
        "training.safetensors",
        "style.safetensors",
        "manifest.json",
    }
    assert [p.name for p in tmp_path.iterdir()] == ["000012"]


def test_only_the_requested_arrays_are_read(tmp_path):
    path = write(tmp_path / "1", state(), MANIFEST)
    (path / "style.safetensors").unlink()
    assert set(read(path, ["policy"]).state) == {"policy"}
    with pytest.raises(CheckpointError, match=r"style\.safetensors"):
        read(path)


@pytest.mark.parametrize("name", ["policy.safetensors", "training.safetensors"])
@pytest.mark.parametrize("damage", ["truncated", "flipped", "empty"])
def test_damage_is_found_and_named(tmp_path, name, damage):
    path = write(tmp_path / "1", state(), MANIFEST)
    raw = bytearray((path / name).read_bytes())
    if damage == "truncated":
        raw = raw[:-5]
    elif damage == "flipped":
        raw[-3] ^= 4
    else:
        raw = bytearray()
    (path / name).write_bytes(bytes(raw))
    with pytest.raises(CheckpointError, match=name) as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_a_pointer_in_place_of_weights_is_called_that(tmp_path):
    """As a clone without Git LFS has it."""
    path = write(tmp_path / "1", state(), MANIFEST)
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n"
    (path / "policy.safetensors").write_bytes(pointer)
    with pytest.raises(CheckpointError, match=r"policy\.safetensors: a Git LFS pointer"):
        read(path)


def test_damaged_manifest(tmp_path):
    path = write(tmp_path / "1", state(), MANIFEST)
    text = (path / "manifest.json").read_text()
    for bad in (text[: len(text) // 2], "", "[]", text.replace('"iteration"', '"x"')):
        (path / "manifest.json").write_text(bad)
        with pytest.raises((CheckpointError, LayoutError), match=r"manifest\.json"):
            read(path)
    with pytest.raises(CheckpointError, match=r"no manifest\.json"):
        read(tmp_path)


def test_other_layouts_are_refused_with_the_difference(tmp_path):
    path = write(tmp_path / "1", state(), MANIFEST)
    with pytest.raises(LayoutError, match=r"root_rotation 6.*root_rotation 4"):
        read(path, layout=replace(LAYOUT, features=(("root_height", 1), ("root_rotation", 4))))
    with pytest.raises(LayoutError, match="goal"):
        read(path, layout=replace(LAYOUT, goal=(("hip", 3), ("head", 3))))
    with pytest.raises(LayoutError, match=r"hidden are \(8, 4\)"):
        read(path, layout=replace(LAYOUT, hidden=(16,)))
    with pytest.raises(
        LayoutError, match=r"has no linear map beside its layers: leave out --ppo.skip"
    ):
        read(path, layout=replace(LAYOUT, skip=True))
    read(path, layout=replace(LAYOUT, task="walk"))


def test_unknown_things_are_refused_before_anything_is_left(tmp_path):
    for content in ({"x": object()}, {"x": {1: 2}}):
        with pytest.raises(CheckpointError):
            write(tmp_path / "1", {"policy": content}, MANIFEST)
    assert list(tmp_path.iterdir()) == []


def _write_with_little_room(directory: Path) -> None:
    """Runs in a process of its own, whose files may not grow beyond 1 MB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))
    big = {"policy": {"w": torch.ones(10)}, "training": {"replay": torch.ones(1_000_000)}}
    try:
        write(directory / "000002", big, MANIFEST)
    except CheckpointError as error:
        print("refused:", error)


def test_a_full_disk_leaves_the_older_checkpoint_and_nothing_half_written(tmp_path):
    older = write(tmp_path / "000001", state(), MANIFEST)
    code = (
        "from pathlib import Path; import tests.policy.checkpoints.test_format as t;"
        f"t._write_with_little_room(Path({str(tmp_path)!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=120,
    )
    assert "refused: cannot write checkpoint" in done.stdout, done.stdout + done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["000001"]
    assert_same(read(older).state, state())
