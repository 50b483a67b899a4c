"""A folder that synthesize wrote is one of clips, whatever else it holds."""

from pathlib import Path

import pytest

from console.app import main
from console.realism import sources
from world import tasks
from world.motions import clip_file


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A motion as a clip, and as SMPL parameters beside it."""
    folder = tmp_path_factory.mktemp("motions")
    words = ["synthesize", "walk", "--seconds", "2", "--out"]
    assert main([*words, str(folder / "w.npz"), str(folder / "w.smpl.npz")]) == 0
    return folder


@pytest.mark.parametrize("command", ["list", "play", "check"])
def test_smpl_parameters_are_no_clips(
    command: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = {
        "list": ["motions", "list", str(folder)],
        "play": ["motions", "play", str(folder), "--html", str(tmp_path / "a.html")],
        "check": ["motions", "check", str(folder)],
    }[command]
    assert main(words) == 0
    note = "note: left out, SMPL parameters and not clips: w.smpl.npz\n"
    # these are measured as an import of them would be
    assert capsys.readouterr().err == ("" if command == "check" else note)


def test_nor_are_they_reference_clips(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clips, _ = sources.mocap([str(folder)], tasks.make("walk").affordance.clips, "recording")
    assert (
        clips and "left out, SMPL parameters and not clips: w.smpl.npz" in capsys.readouterr().err
    )


def test_an_import_of_smpl_parameters_is_a_clip_of_another_name(
    folder: Path, tmp_path: Path
) -> None:
    assert main(["motions", "import", str(folder / "w.smpl.npz"), "--out", str(tmp_path)]) == 0
    assert clip_file.read(tmp_path / "w.npz").frames == 61
