"""Motions of policies and recordings as clips, and the groups of mocap."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from console.realism import sources
from console.recording import format as recording
from console.recording.format import Recording
from tests.support.console.recordings import take
from tests.support.paths import ROOT
from tests.support.world.clips import saved
from world.character import model as character
from world.errors import ConfigError
from world.motions.synthetic import library
from world.motions.uses.seat import SEAT
from world.realism import measures


def test_a_take_is_the_same_motion_as_a_clip() -> None:
    one = take(30)
    one.qpos[:, 0] = np.linspace(0.0, 1.0, 30)
    clip = sources.clip_of_take(one, "a")
    np.testing.assert_allclose(clip.qpos(), one.qpos, atol=1e-5)
    assert clip.fps == character.CONTROL_HZ and clip.box is None


def test_a_box_is_held_while_both_hands_touch_it() -> None:
    """A box between the hands of the rest pose, and one in front of them."""
    one = take(2)
    hands = [character.BODIES.index(name) for name in ("right_hand", "left_hand")]
    at = measures.positions(torch.from_numpy(one.qpos))[0, hands].numpy()
    middle, width = at.mean(axis=0), np.abs(at[1, 1] - at[0, 1])
    pose = np.zeros((2, 7))
    pose[:, :3], pose[:, 3] = middle, 1.0
    pose[1, 0] += 1.0
    half = np.array([0.15, 0.5 * width - 0.04, 0.15])
    boxed = replace(one, qpos=np.concatenate((one.qpos, pose), axis=1), cargo=half)
    box = sources.clip_of_take(boxed, "a").box
    assert box is not None and box.held.tolist() == [True, False]
    assert box.size_m == pytest.approx(tuple(2 * half))
    np.testing.assert_allclose(box.pose, pose, atol=1e-6)


def test_recordings_name_their_task(tmp_path: Path) -> None:
    path = tmp_path / "a.msgpack"
    recording.write(path, Recording([take(40)], {"task": "sit"}))
    clips, task = sources.clips_of_recording(path)
    assert task == "sit" and [clip.frames for clip in clips] == [40]
    recording.write(path, Recording([take(4)], {"task": "juggle"}))
    with pytest.raises(ConfigError, match="recorded with task 'juggle'"):
        sources.clips_of_recording(path)


def test_a_reference_is_named_by_what_its_clips_are() -> None:
    own = library.walking(np.random.default_rng(0), 1.0)
    recorded = replace(own, source="01.bvh")
    assert sources.reference([own], ("clips",)) == "the package's synthetic clips"
    assert sources.reference([own, recorded], ("some/cmu", "b.npz")) == "clips of cmu, b.npz"


def test_policies_are_folders_with_a_manifest(tmp_path: Path) -> None:
    assert sources.is_policy(ROOT / "pretrained" / "sit") and not sources.is_policy(tmp_path)
    assert not sources.is_policy(tmp_path / "none")


def test_mocap_is_grouped_by_file_or_folder(tmp_path: Path) -> None:
    clip = library.walking(np.random.default_rng(0), 1.0)
    for name in ("one/a", "one/b", "two/a"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        saved(tmp_path / f"{name}.npz", clip)
    _, files = sources.mocap((str(tmp_path),), SEAT, "recording")
    _, folders = sources.mocap((str(tmp_path),), SEAT, "folder")
    assert len(set(files)) == 3 and len(set(folders)) == 2
