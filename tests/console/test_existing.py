"""A command replaces files that it wrote itself, and no others."""

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest

from console import commands, existing, outputs
from console.animation import files as animation
from console.app import main
from console.motions import page as motions_page
from console.motions import play as motions_play
from console.objects import page as objects_page
from console.recording import format as recording
from console.report import page as report
from tests.support.console import recordings
from tests.support.paths import ROOT
from world.errors import ConfigError
from world.meshes import collection
from world.motions.synthetic import library

PRETRAINED = ROOT / "pretrained"
WRITTEN = {
    "json": [
        (commands.Evaluate(Path("sit")), "evaluation.json"),
        (commands.Realism(Path("sit")), "realism.json"),
        (commands.Plan(), "plan.json"),
        (commands.Bench("world"), "bench.json"),
    ],
    "out": [
        (commands.Evaluate(Path("sit"), worst=3), "worst.html"),
        (commands.Report(Path("sit")), "report.html"),
        (commands.Video(Path("sit")), "film.mp4"),
        (commands.Video(Path("sit")), "film.webp"),
        (commands.Video(Path("sit")), "film.gif"),
        (commands.Export(Path("sit"), Path("x.onnx")), "sit.onnx"),
        (commands.Export(Path("m.msgpack"), Path("x.bvh")), "m.bvh"),
        (commands.Export(Path("m.msgpack"), Path("x.glb")), "m.glb"),
        (commands.Export(Path("m.msgpack"), Path("x.gltf")), "m.gltf"),
        (commands.Export(Path("m.msgpack"), Path("x.smpl.npz")), "m.smpl.npz"),
    ],
    "record": [(commands.Evaluate(Path("sit")), "trials.msgpack")],
    "html": [
        (commands.ObjectsShow(), "objects.html"),
        (commands.MotionsPlay(), "clips.html"),
    ],
    "sheet": [(commands.ObjectsShow(), "sheet.png"), (commands.Video(Path("sit")), "strip.png")],
}
CASES = [(field, *case) for field, cases in WRITTEN.items() for case in cases]


@pytest.mark.parametrize(("field", "command", "name"), CASES, ids=[case[2] for case in CASES])
def test_a_file_that_the_command_did_not_write_stays(
    field: str, command: object, name: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    command = dataclasses.replace(command, **{field: path})  # pyright: ignore
    outputs.require(command)
    path.write_text("")  # as mktemp makes one: there is nothing to lose
    outputs.require(command)
    for content, what in (
        (b"my notes\n", "a text"),
        (b'{"title": "a thesis"}', "other JSON|another glTF scene"),
        (b"<!doctype html><title>My inhabitants</title>", "an HTML page"),
        (b"HIERARCHY\nROOT Hips", "another BVH motion"),
        (b"\x00\x01\x02\xff", "a file of no known kind"),
    ):
        path.write_bytes(content)
        if name.endswith(".gltf"):
            what += "|another glTF scene"
        with pytest.raises(ConfigError, match=rf"{path}: exists and is ({what}), not .*; name an"):
            outputs.require(command)


def test_a_file_that_the_command_wrote_is_replaced(tmp_path: Path) -> None:
    """By what the writers of this package make."""
    clip = library.walking(np.random.default_rng(0), 1.0)
    recording.write(tmp_path / "a.msgpack", recording.Recording([recordings.take()], {}))
    motion = animation.Animation(clip)
    for suffix in animation.WRITERS:
        animation.write(tmp_path / f"a{suffix}", motion, commands.animation.AnimationFlags())
    (tmp_path / "a.html").write_text(report.document("a title", [], []))
    motions_play.write(tmp_path / "clips.html", motions_page.page([clip]))
    objects_page.write(tmp_path / "objects.html", collection.pieces(("test",))[:1])
    shutil.copy(PRETRAINED / "sit" / "evaluation.json", tmp_path)
    assert main(["plan", "--json", str(tmp_path / "plan.json")]) == 0
    for command in (
        commands.Evaluate(Path("sit"), json=tmp_path / "evaluation.json"),
        commands.Evaluate(Path("sit"), record=tmp_path / "a.msgpack"),
        commands.Report(Path("sit"), out=tmp_path / "a.html"),
        commands.MotionsPlay(html=tmp_path / "clips.html"),
        commands.ObjectsShow(html=tmp_path / "objects.html"),
        commands.Plan(json=tmp_path / "plan.json"),
        *(commands.Export(Path("m"), tmp_path / f"a{suffix}") for suffix in animation.WRITERS),
    ):
        outputs.require(command)
    # of another command
    with pytest.raises(ConfigError, match="an estimate of inhabit plan, not an evaluation of"):
        outputs.require(commands.Evaluate(Path("sit"), json=tmp_path / "plan.json"))


def test_a_motion_of_a_user_with_a_licence_beside_it_stays(tmp_path: Path) -> None:
    """The licence is in a file of REUSE's name, as inhabit writes it too."""
    motion, terms = tmp_path / "a.bvh", tmp_path / "a.bvh.license"
    clip = animation.Animation(library.walking(np.random.default_rng(0), 1.0))
    animation.write(motion, clip, commands.animation.AnimationFlags())
    command = commands.Export(Path("m"), motion)
    outputs.require(command)
    assert terms.read_text().endswith("\nmade by inhabit\n")
    for content in ("CC0-1.0\n", "SPDX-FileCopyrightText: 2024 Bo\n"):
        terms.write_text(content)
        with pytest.raises(ConfigError, match="is another BVH motion, not a BVH motion that inh"):
            outputs.require(command)


def test_a_device_is_not_replaced() -> None:
    with pytest.raises(ConfigError, match="--json /dev/null: no regular file; name another file"):
        existing.require(Path("/dev/null"), "--json ", existing.PLAN)


def test_a_file_is_refused_before_the_evaluation(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    notes = tmp_path / "notes.json"
    notes.write_text('{"mine": 1}')
    assert main(["evaluate", "sit", "--json", str(notes)]) == 2
    told = capsys.readouterr()
    assert told.err.count("\n") == 1 and "is other JSON, not an evaluation" in told.err
    assert told.out == "" and notes.read_text() == '{"mine": 1}'


def test_the_page_that_a_report_names_itself_replaces_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("sit-report.html").write_text("mine")
    assert main(["report", "sit", "--trials", "3"]) == 2
    assert "sit-report.html: exists and is a text, not a page of inhabit" in capsys.readouterr().err
