"""`inhabit train track` and what follows it, on two clips of a few seconds."""

import json
from pathlib import Path

import pytest

from console.app import main
from tests.support.track_scenes import clips
from world.motions import clip_file


def trained(folder: Path, name: str, actors: int) -> list[dict[str, float]]:
    motions = folder / "clips"
    if not motions.exists():
        motions.mkdir()
        for clip in clips()[::2]:
            clip_file.write(motions / f"{clip.name}.npz", clip)
    words = ["train", "track", "--run", str(folder / name)]
    words += ["--motions", str(motions), "--iterations", "3", "--scenes", "64", "--block", "32"]
    words += ["--horizon", "16", "--actors", str(actors), "--ppo.hidden", "32", "16"]
    words += ["--ppo.warmup-iterations", "1", "--world.track.boxes", "1"]
    assert main(words) == 0
    lines = (folder / name / "metrics.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def test_a_training_is_the_same_over_one_and_two_actors_and_is_evaluated_by_clip(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = (trained(tmp_path, f"run{actors}", actors) for actors in (1, 2))
    assert len(one) == 3
    for ours, theirs in zip(one, two, strict=True):
        free = {k for k in ours if k.startswith("rate/")} | {"seconds", "actors/alive"}
        assert {k: v for k, v in ours.items() if k not in free} == {
            k: v for k, v in theirs.items() if k not in free
        }
    last = one[-1]
    assert "reward/style" not in last
    config = json.loads((tmp_path / "run1" / "config.json").read_text())
    assert config["preset"] == "track"
    assert 0.5 < last["reward/body"] < 1.0
    ends = sum(last[f"episode/{name}"] for name in ("end_body", "end_root", "end_box", "end_grip"))
    assert ends >= last["episode/fall"] > 0.0

    out = tmp_path / "figures.json"
    words = ["evaluate", str(tmp_path / "run1"), "--trials", "12", "--json", str(out)]
    assert main([*words, "--record", str(tmp_path / "takes.msgpack")]) == 0
    figures = json.loads(out.read_text())
    assert figures["trials"] == 12
    assert [row["clip"] for row in figures["by_clip"]] == sorted(c.name for c in clips()[::2])
    boxed, seated = figures["by_clip"]
    assert boxed["object_cm"] > 0.0
    assert seated["object_cm"] is None
    assert 0.0 < figures["body_cm"] < 30.0
    assert (tmp_path / "takes.msgpack").stat().st_size > 10_000
    assert main(["evaluate", str(tmp_path / "run1"), "--perturb", "moved"]) == 2
    # its set-points need the reference: nothing is served or exported that would be wrong
    capsys.readouterr()
    run, onnx = str(tmp_path / "run1"), str(tmp_path / "track.onnx")
    serve = ["serve", run, "--listen", "127.0.0.1:0"]
    for words, code in ((["export", run, onnx], 1), (serve, 1)):
        assert main(words) == code
        error = capsys.readouterr().err
        assert "follows clips" in error and "use evaluate, play or video" in error
        assert error.count("\n") == 1
    assert not Path(onnx).exists()

    page = tmp_path / "run1" / "report.html"
    assert main(["report", run, "--trials", "6"]) == 0
    text = page.read_text()
    for heading in ("Best, median and worst trial", "By clip", "Training", "Settings"):
        assert f"<h2>{heading}</h2>" in text
    assert text.count("data-take=") == 3 and '"ghost":true' in text
    assert str(tmp_path) not in text
