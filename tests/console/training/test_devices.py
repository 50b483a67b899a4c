"""`inhabit train` on mujoco-warp, and the lines that refuse what a machine does not have."""

from pathlib import Path

import pytest
import torch

from console.app import main
from policy.checkpoints.format import read
from tests.support.small_clips import write

SMALL = ["--scenes", "8", "--block", "8", "--clone-passes", "0", "--iterations", "1"]
SMALL += ["--world.pieces", "2", "--world.scales", "1", "--actors", "1"]


def test_it_trains_on_warp_and_goes_on_from_there_on_mujoco(tmp_path: Path) -> None:
    pytest.importorskip(
        "mujoco_warp", reason="mujoco-warp is not installed: pip install 'inhabit[warp]'"
    )
    words = ["train", "sit", *SMALL, "--motions", str(write(tmp_path / "clips"))]
    run = tmp_path / "run"
    assert main([*words, "--run", str(run), "--simulator", "warp", "--device", "cpu"]) == 0
    found = read(run / "checkpoints" / "latest")
    scenes = found.state["training"]["fleet"]["shard"]
    assert scenes["physics_qpos"].shape == (8, 43) and found.manifest.samples == 64
    assert scenes["physics_qpos"].dtype == torch.float64
    again = [*words, "--run", str(tmp_path / "other"), "--init", str(run)]
    assert main(again) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--simulator", "warp", "--runner", "ray"], "--simulator warp steps all scenes on one"),
        (["--warp.njmax", "0"], "--warp.nconmax and --warp.njmax must be above 0"),
    ],
)
def test_what_cannot_be_is_refused_before_a_run_is_made(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", *SMALL, "--run", str(run), *words]) != 0
    assert said in capsys.readouterr().err
    assert not run.exists()


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_no_gpu_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = tmp_path / "run"
    assert main(["train", "sit", *SMALL, "--run", str(run), "--device", "cuda"]) != 0
    error = capsys.readouterr().err.strip()
    assert error.startswith("inhabit: --device cuda: ") and "\n" not in error
    assert not run.exists()
