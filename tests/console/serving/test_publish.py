"""Published folders say what they are."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from console.app import main
from console.serving.publish import kept_evaluations
from policy.checkpoints.format import read, write
from tests.support.paths import ROOT


def test_a_published_folder_describes_itself_and_acts(tmp_path: Path) -> None:
    """The committed policy, published again: nothing of this machine, and the same weights."""
    source = ROOT / "pretrained" / "sit"
    figures = tmp_path / "e.json"
    figures.write_text((source / "evaluation.json").read_text())
    disturbed = tmp_path / "p.json"
    disturbed.write_text(json.dumps(json.loads(figures.read_text()) | {"perturbation": "moved"}))
    out = tmp_path / "mine"
    words = [
        "publish",
        str(source),
        str(out),
        "--data",
        "clips",
        "--licence",
        "as you like",
        "--relicense",
    ]
    imported = tmp_path / "i.json"
    meshes = {"objects": "mine", "held_out": True}
    imported.write_text(json.dumps(json.loads(figures.read_text()) | meshes))
    given = [str(figures), str(disturbed), str(imported)]
    assert main([*words, "--evaluation", *given]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["notes"]["data"] == "clips"
    # the data that the source names stay, whatever is stated beside them
    lineage = json.loads(manifest["notes"]["lineage"])
    assert "SAMP" in lineage[0]["what"] and "CC BY-NC-SA" in lineage[0]["licence"]
    assert manifest["notes"]["licence"] == "as you like"
    assert json.loads(manifest["notes"]["experiment"])["world"]["motions"] == []
    assert json.loads(manifest["notes"]["evaluation"])["perturbation"] == "none"
    assert json.loads((out / "evaluation.json").read_text())["checkpoint"] == "mine"
    assert json.loads((out / "evaluation-moved.json").read_text())["perturbation"] == "moved"
    assert json.loads((out / "evaluation-imported.json").read_text())["held_out"] is True
    assert "held_out" not in json.loads((out / "evaluation.json").read_text())
    assert (out / "policy.safetensors").read_bytes() == (source / "policy.safetensors").read_bytes()
    assert main([*words]) == 1  # it exists


def test_evaluations_that_are_kept_with_the_checkpoint_come_along(tmp_path: Path) -> None:
    """Of the published folder itself, and of a run's the largest of each perturbation, of this
    checkpoint and by the default protocol."""
    source = ROOT / "pretrained" / "sit"
    again = tmp_path / "again"
    assert main(["publish", str(source), str(again)]) == 0
    names = {file.name for file in source.glob("evaluation*.json")}
    assert len(names) == 3 and {file.name for file in again.glob("evaluation*.json")} == names
    figures = json.loads((source / "evaluation.json").read_text())
    run = tmp_path / "run"
    shutil.copytree(source, run / "checkpoints" / "000007")
    (run / "config.json").write_text("{}")
    (run / "evaluations").mkdir()
    number = figures["iteration"]
    for name, other in {
        "small": {"trials": 8},
        "large": {"trials": 64},
        "older": {"trials": 128, "iteration": number - 1},
        "near": {"trials": 128, "start_m": [1.0, 3.0]},
        "train": {"trials": 128, "objects": "train"},
        "moved": {"trials": 16, "perturbation": "moved"},
        "pieces": {"trials": 16, "objects": "mine"},
        "held": {"trials": 16, "objects": "mine", "held_out": True},
        "both": {"trials": 16, "objects": "mine", "held_out": True, "perturbation": "moved"},
    }.items():
        (run / "evaluations" / f"{name}.json").write_text(json.dumps(figures | other))
    (run / "evaluations" / "broken.json").write_text("{")
    kept = kept_evaluations(run / "checkpoints" / "000007", number)
    assert sorted(file.stem for file in kept) == ["both", "held", "large", "moved"]


def test_no_path_of_a_teacher_is_published(tmp_path: Path) -> None:
    """A checkpoint taught by policies of this machine; what it learned needs none of them."""
    taught, out = tmp_path / "taught", tmp_path / "mine"
    shutil.copytree(ROOT / "pretrained" / "walk", taught)
    found = read(taught, ("policy",))
    settings = json.loads(found.manifest.notes["experiment"])
    here = str(tmp_path)
    settings["world"] |= {"walker": here, "tracker": here, "motions": [here]}
    settings["world"]["track"]["teacher"] = here
    notes = found.manifest.notes | {"experiment": json.dumps(settings)}
    shutil.rmtree(taught)
    write(taught, found.state, replace(found.manifest, notes=notes))
    assert main(["publish", str(taught), str(out)]) == 0
    assert here not in (out / "manifest.json").read_text()


def test_two_evaluations_of_a_kind_or_none_at_all_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    figures, broken = str(source / "evaluation.json"), tmp_path / "b.json"
    broken.write_text("[]")
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips"]
    assert main([*words, "--evaluation", figures, figures]) in (1, 2)
    assert "a second evaluation with perturbation none: give one" in capsys.readouterr().err
    assert main([*words, "--evaluation", str(broken)]) in (1, 2)
    assert "is not an evaluation of `inhabit evaluate --json`" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()


def test_an_average_needs_the_checkpoints(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = ROOT / "pretrained" / "sit"
    words = ["publish", str(source), str(tmp_path / "mine"), "--data", "clips"]
    assert main([*words, "--average", "2"]) == 1
    assert "--average 2: only 1 up to" in capsys.readouterr().err
    assert main([*words, "--average", "0"]) in (1, 2)
    assert "--average 0: must be 1 to 1000" in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()


def notes_of(folder: Path) -> dict[str, str]:
    return json.loads((folder / "manifest.json").read_text())["notes"]


def test_data_and_licence_are_those_of_the_checkpoint(tmp_path: Path) -> None:
    source, out = ROOT / "pretrained" / "sit", tmp_path / "mine"
    assert main(["publish", str(source), str(out)]) == 0
    before, after = notes_of(source), notes_of(out)
    assert after["data"] == before["data"] and after["licence"] == before["licence"]
    # published twice, it says the same
    again = tmp_path / "again"
    assert main(["publish", str(out), str(again)]) == 0
    assert notes_of(again) == after


def test_a_laxer_licence_needs_relicense(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = str(ROOT / "pretrained" / "sit"), tmp_path / "mine"
    assert main(["publish", source, str(out), "--licence", "Apache-2.0"]) == 2
    line = capsys.readouterr().err
    assert line.startswith("inhabit: --licence Apache-2.0: restricts less") and "SAMP" in line
    assert "non-commercial use" in line and "--relicense" in line and line.count("\n") == 1
    assert not out.exists()
    assert main(["publish", source, str(out), "--licence", "CC BY-NC-SA 4.0"]) == 0
    assert notes_of(out)["licence"] == "CC BY-NC-SA 4.0"
    words = ["--licence", "Apache-2.0", "--relicense", "--replace"]
    assert main(["publish", source, str(out), *words]) == 0
    # the terms of the data stay in its lineage, and hold for what is made of it
    assert "SAMP" in json.loads(notes_of(out)["lineage"])[0]["what"]
    assert main(["publish", str(out), str(tmp_path / "b"), "--licence", "MIT"]) == 2


@pytest.mark.parametrize("name", ["sit-free", "lie-free", "walk"])
def test_a_published_policy_is_published_again_with_the_licence_that_it_has(
    name: str, tmp_path: Path
) -> None:
    assert main(["publish", str(ROOT / "pretrained" / name), str(tmp_path / "out")]) == 0
    assert notes_of(tmp_path / "out")["licence"] == notes_of(ROOT / "pretrained" / name)["licence"]


def test_nothing_but_a_published_policy_is_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither a folder of the user's own, nor a run, nor a file; a published one is."""
    source = str(ROOT / "pretrained" / "walk")
    mine, run, file = tmp_path / "mine", tmp_path / "run", tmp_path / "file"
    (mine / "deep").mkdir(parents=True)
    (mine / "thesis.txt").write_text("x")
    shutil.copytree(source, run / "checkpoints" / "000007")
    (run / "config.json").write_text("{}")
    file.write_text("x")
    for out, what in ((mine, "holds deep"), (run, "holds checkpoints"), (file, "a file; name a")):
        assert main(["publish", source, str(out), "--replace"]) in (1, 2)
        assert what in capsys.readouterr().err
    assert (mine / "thesis.txt").read_text() == "x" and (mine / "deep").is_dir()
    assert (run / "config.json").exists() and (run / "checkpoints" / "000007").is_dir()
    out = tmp_path / "out"
    assert main(["publish", source, str(out)]) == 0
    assert main(["publish", source, str(out)]) == 1
    assert "add --replace" in capsys.readouterr().err
    assert main(["publish", source, str(out), "--replace"]) == 0


def test_a_folder_published_onto_itself_loses_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With another licence, and with one more evaluation."""
    folder = tmp_path / "mine"
    shutil.copytree(ROOT / "pretrained" / "sit", folder)
    disturbed = json.loads((folder / "evaluation-moved.json").read_text())
    # neither of them is one that a publication takes over by itself
    (folder / "evaluation-near.json").write_text(json.dumps(disturbed | {"start_m": [1.0, 3.0]}))
    (folder / "metrics.jsonl").write_text("".join(f'{{"iteration": {n}}}\n' for n in range(399)))
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    assert "average" in notes_of(folder)
    added = tmp_path / "more.json"
    added.write_text(json.dumps(disturbed | {"objects": "meshes", "held_out": True}))
    monkeypatch.chdir(folder)
    words = ["publish", str(folder), ".", "--replace"]
    assert main([*words, "--licence", "MIT", "--relicense", "--evaluation", str(added)]) == 0
    after = {file.name: file.read_bytes() for file in folder.iterdir()}
    assert set(after) - set(before) == {"evaluation-imported-moved.json"}
    changed = {name for name in before if after[name] != before[name]}
    assert changed == {"manifest.json"}
    notes = json.loads(before["manifest.json"])["notes"]
    assert notes_of(folder).keys() == notes.keys() | {"lineage"}
    assert notes_of(folder)["licence"] == "MIT" and notes_of(folder)["data"] == notes["data"]
    assert notes_of(folder)["average"] == notes["average"]
    assert json.loads(after["evaluation-imported-moved.json"])["checkpoint"] == "mine"
    read(folder, ("policy",))  # its checksums hold


def test_a_checkpoint_of_a_run_is_not_published_onto_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of critic and optimiser nothing would be left."""
    checkpoint = tmp_path / "run" / "checkpoints" / "000007"
    shutil.copytree(ROOT / "pretrained" / "walk", checkpoint)
    (checkpoint / "learner.safetensors").write_bytes(b"state of the optimiser")
    assert main(["publish", str(checkpoint), str(checkpoint), "--replace"]) == 1
    assert "holds learner.safetensors, which is no part of a published" in capsys.readouterr().err
    assert (checkpoint / "learner.safetensors").read_bytes() == b"state of the optimiser"


def test_metrics_of_a_named_policy_and_of_a_checkpoint_of_a_run_are_published(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["publish", "walk", "walks"]) == 0
    metrics = ROOT / "pretrained" / "walk" / "metrics.jsonl"
    assert Path("walks/metrics.jsonl").read_text() == metrics.read_text()
    checkpoint = Path("run/checkpoints/000007")
    shutil.copytree(ROOT / "pretrained" / "walk", checkpoint)
    (checkpoint / "metrics.jsonl").unlink()
    Path("run/metrics.jsonl").write_text('{"iteration": 7}\n')
    assert main(["publish", str(checkpoint), "mine"]) == 0
    assert Path("mine/metrics.jsonl").read_text() == '{"iteration": 7}\n'
