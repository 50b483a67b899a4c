"""What is written down of a scene that blew up, from a shard that says one did."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import torch

from console.recording import format as recording
from console.run import nan_dump
from console.run.nan_dump import NanDump
from world.character import model as character
from world.furniture.catalogue import find

PIECES = [find("chair-train-000"), find("low-stool-train-000")]


class Shard:
    """Two scenes whose heights are the clock; scene 1 is broken at clock 5 and later."""

    clock = 0

    def state_dict(self) -> dict[str, torch.Tensor]:
        qpos = torch.from_numpy(character.standing_qpos()).repeat(2, 1)
        qpos[:, 2] = float(self.clock)
        return {
            "physics_qpos": qpos,
            "physics_qvel": torch.zeros(2, 34),
            "physics_ctrl": torch.zeros(2, 28),
            "physics_mocap_pos": torch.zeros(2, 1, 3),
            "physics_mocap_quat": torch.tensor([1.0, 0, 0, 0]).repeat(2, 1, 1),
            "episode": torch.tensor([0, int(self.clock >= 2)]),
            "variant": torch.tensor([0, 1]),
        }

    def step(self, action: torch.Tensor) -> Any:
        self.clock += 1
        return SimpleNamespace(finite=torch.tensor([True, self.clock < 5]))


def test_the_states_of_the_episode_are_kept(tmp_path: Path) -> None:
    box = NanDump(Shard(), range(6, 8), PIECES, tmp_path)  # pyright: ignore
    for step in range(5):
        box.step(torch.full((2, 28), float(step)))
    (file,) = tmp_path.iterdir()
    assert file.name == "broken-7-5.msgpack"
    found = recording.read(file)
    assert found.meta["reason"] == "not finite" and found.meta["scene"] == 7
    assert found.meta["last_action"] == [4.0] * 28
    (take,) = found.takes
    assert take.qpos[:, 2].tolist() == [2.0, 3.0, 4.0], "of this episode alone, oldest first"
    assert take.piece == "low-stool-train-000"


def test_a_broken_run_does_not_fill_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(nan_dump, "MOST", 3)
    # the workers of a run share the folder, and their number
    boxes = [NanDump(Shard(), range(k, k + 2), PIECES, tmp_path) for k in (0, 2)]  # pyright: ignore
    for _ in range(12):
        for box in boxes:
            box.step(torch.zeros(2, 28))
    assert len(list(tmp_path.iterdir())) == 3
