"""An evaluation as its user meets it."""

import json
from pathlib import Path

from console.app import main
from console.evaluation.command import file_name, unfamiliar
from world.config import WorldConfig
from world.furniture.catalogue import catalogue


def test_evaluate_does_not_depend_on_threads(run: Path, tmp_path: Path) -> None:
    figures = []
    for threads in ("1", "2"):
        out = tmp_path / f"{threads}.json"
        asked = ["evaluate", str(run), "--trials", "140", "--threads", threads, "--json", str(out)]
        assert main([*asked, "--quality", "8"]) == 0
        figures.append(json.loads(out.read_text()))
        figures[-1].pop("wall_s")
    assert figures[0] == figures[1]
    assert {"success", "sustained", "falls", "by_object", "by_distance"} <= set(figures[0])
    assert {"by_stage", "quality", "preset"} <= set(figures[0])
    assert figures[0]["pieces"] == len(figures[0]["by_object"]) > 1
    assert figures[0]["quality"]["policy"]["style_reward"] > 0
    assert figures[0]["quality"]["mocap"]["nearest_mocap"]["median"] > 0
    assert list((run / "evaluations").glob("*.json"))


def test_evaluations_with_other_settings_have_other_names() -> None:
    usual = {
        "task": "sit", "objects": "test", "perturbation": "none", "preset": "table1",
        "start_m": [1.0, 10.0], "seed": 0, "trials": 64,
    }  # fmt: skip
    others = (
        {}, {"start_m": [1.0, 3.0]}, {"simulator": "warp"}, {"held_out": True}, {"seed": 1},
        {"perturbation": "moved"}, {"preset": "weights"}, {"trials": 8}, {"motions": ["a"]},
        {"motions": ["a", "b"]}, {"objects": "train"},
    )  # fmt: skip
    names = [file_name("000100", usual | other) for other in others]
    assert names[:3] == [
        "000100-test-0-64.json", "000100-test-1-3m-0-64.json", "000100-test-warp-0-64.json",
    ]  # fmt: skip
    assert len(set(names)) == len(others)
    # table3 has distances of its own
    assert file_name("1", usual | {"preset": "table3", "start_m": [1.0, 5.0]}).count("m-") == 0


def test_classes_without_training_pieces_are_named() -> None:
    trained = WorldConfig(task="sit", pieces=1)
    (only,) = {piece.category for piece in catalogue("train", 1)}
    others = {piece.category for piece in catalogue("test", 12)} - {only}
    assert others and unfamiliar(trained, catalogue("test", 12)) == sorted(others)
    assert unfamiliar(WorldConfig(task="sit"), catalogue("test", 12)) == []
    gone = WorldConfig(task="sit", objects=("/nowhere",))
    assert unfamiliar(gone, catalogue("test", 12)) == []
