"""Files to write are checked before the work: suffix, folder, permission."""

import typing
from pathlib import Path

import pytest

from console import commands, inputs, outputs
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


def test_outputs_of_every_command_are_checked_before_it_runs(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    below = file / "a.json"
    commands_of_files = [
        ("--json ", commands.Evaluate(Path("sit"), json=below)),
        ("--record ", commands.Evaluate(Path("sit"), record=file / "a.msgpack")),
        ("--out ", commands.Report(Path("sit"), out=file / "a.html")),
        ("", commands.Video(Path("sit"), out=below)),
        ("", commands.Export(Path("sit"), below)),
        ("--html ", commands.ObjectsShow(html=file / "a.html")),
        ("--html ", commands.MotionsPlay(html=file / "a.html")),
        ("--json ", commands.Plan(json=below)),
        ("--json ", commands.Bench("world", json=below)),
    ]
    for flag, command in commands_of_files:
        with pytest.raises(
            ConfigError, match=rf"^{flag}{file}/a\.\w+: {file} is not a writable folder$"
        ):
            outputs.require(command)
    commands_of_folders = [
        ("--out ", commands.MotionsImport((tmp_path,), file)),
        ("--out ", commands.ObjectsImport((tmp_path,), commands.Meshes(), out=file)),
        ("--state ", commands.Style(Path("sit"), state=file)),
        ("", commands.Publish(Path("sit"), file)),
    ]
    for flag, command in commands_of_folders:
        with pytest.raises(ConfigError, match=f"^{flag}{file}: a file; name a folder$"):
            outputs.require(command)
    for flag, command, wanted in (
        ("--html", commands.ObjectsShow(html=Path("a.txt")), ".html or .htm"),
        ("--sheet", commands.ObjectsShow(sheet=Path("a.txt")), ".png"),
        ("--record", commands.Evaluate(Path("sit"), record=Path("a.txt")), ".msgpack"),
    ):
        with pytest.raises(ConfigError, match=f"^{flag} a.txt: choose {wanted}$"):
            outputs.require(command)
    outputs.require(commands.MotionsList(json=True))
    outputs.require(commands.Publish(Path("sit"), tmp_path / "new" / "deep"))


def test_every_path_of_a_command_is_an_input_or_an_output() -> None:
    """None is forgotten by both checks."""
    groups = (entry for group in commands.GROUPS for entry in group.entries)
    for entry in (*commands.COMMANDS, *groups):
        for name, hint in typing.get_type_hints(entry.flags).items():
            if Path in (hint, *typing.get_args(hint)):
                assert (name in inputs.FIELDS) != (name in outputs.FIELDS), (entry.name, name)


def test_a_wrong_suffix_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "carry", "x.pt"]) == 2
    assert capsys.readouterr().err == (
        "inhabit: FILE x.pt: unknown suffix '.pt'; choose .onnx for a policy, "
        ".glb, .gltf, .bvh, .smpl.npz for a motion\n"
    )


def test_no_command_replaces_what_it_reads(tmp_path: Path) -> None:
    rig, motion = tmp_path / "hero.bvh", tmp_path / "sits.msgpack"
    for file in (rig, motion):
        file.write_text("mine")
    (tmp_path / "same.bvh").hardlink_to(rig)
    flags = commands.animation.AnimationFlags(rig=rig)
    for command in (
        commands.Export(motion, rig, files=flags),
        commands.Export(motion, tmp_path / "x" / ".." / "hero.bvh", files=flags),
        commands.Export(motion, tmp_path / "same.bvh", files=flags),
        commands.Export(motion, motion),
        commands.Synthesize(Path("sit"), (tmp_path / "a.bvh", rig), overwrite=True, files=flags),
    ):
        (tmp_path / "x").mkdir(exist_ok=True)
        with pytest.raises(ConfigError, match="the command reads it; name another file"):
            outputs.require(command, tuple(inputs.files(command)))
    outputs.require(commands.Export(motion, tmp_path / "hero-sits.bvh", files=flags))


def test_a_folder_or_another_kind_of_file_is_refused_before_the_work(tmp_path: Path) -> None:
    for command, said in (
        (commands.Evaluate(Path("sit"), json=tmp_path), "--json .*: a folder; name a file"),
        (commands.Report(Path("sit"), out=tmp_path / "a.pdf"), r"--out .*: choose .html or .htm"),
        (commands.Evaluate(Path("sit"), worst=3, out=tmp_path / "a.pdf"), "choose .html or .htm"),
    ):
        with pytest.raises(ConfigError, match=said):
            outputs.require(command)
