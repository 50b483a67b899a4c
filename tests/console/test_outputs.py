"""Files to write are checked before the work: suffix, folder, permission."""

from pathlib import Path

import pytest

from console import outputs
from console.app import main
from world.errors import ConfigError


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("export.pt", "FILE.onnx {path}: its suffix is '.pt'; choose .onnx"),
        ("export", "FILE.onnx {path}: its suffix is missing; choose .onnx"),
        ("folder.onnx", "FILE.onnx {path}: a folder; name a file"),
        ("file/a.onnx", "FILE.onnx {path}: {tmp}/file is not a writable folder"),
    ],
)
def test_a_file_that_cannot_be_written(name: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "folder.onnx").mkdir()
    (tmp_path / "file").write_text("")
    path = tmp_path / name
    with pytest.raises(ConfigError) as caught:
        outputs.check(path, "FILE.onnx", (".onnx",))
    assert str(caught.value) == message.format(path=path, tmp=tmp_path)


def test_files_that_can_be_written_and_none(tmp_path: Path) -> None:
    outputs.check(tmp_path / "a.ONNX", "FILE.onnx", (".onnx",))
    outputs.check(tmp_path / "new" / "deep" / "a.onnx", "FILE.onnx", (".onnx",))
    outputs.check(None, "--sheet", (".png",))


def test_a_wrong_suffix_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "carry", "x.pt"]) == 2
    assert capsys.readouterr().err == (
        "inhabit: FILE x.pt: unknown suffix '.pt'; choose .onnx for a policy, "
        ".glb, .gltf, .bvh, .smpl.npz for a motion\n"
    )
