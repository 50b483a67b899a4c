"""The ablations: commands that the program takes, rows by hand, and a call that goes on."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from console.app import parse
from docs.generate import ablations
from docs.generate.ablations import ALL, ROWS, Row, Trained

DONE = Trained(ALL, 0, 100, 80, 0.1, 1.5, 2.0, 0.9, 0.7, 0.0)


def test_each_row_is_one_command_and_changes_what_it_says() -> None:
    made = {row.name: parse([*ablations.TRAIN, *row.flags]).experiment for row in ROWS}
    assert len(made) == len(ROWS)
    whole = made.pop(ALL)
    assert whole == parse(list(ablations.TRAIN)).experiment
    for name, one in made.items():
        assert one != whole, name
    assert not made["character-only discriminator"].style.object_features
    pieces = [one.world.pieces for name, one in made.items() if "pieces" in name]
    assert pieces == [350, 35, 7] and whole.world.pieces == 60
    assert made["no reference state initialisation"].world.initial.reference == 0.0
    assert made["no size randomisation"].world.scale == (1.0, 1.0)
    assert [made[row.name].style.window for row in ablations.STYLE] == [10, 2, 10]
    assert [made[row.name].style.throttle for row in ablations.STYLE] == [0.9, 1.0, 1.0]
    assert (whole.style.window, whole.style.throttle) == (2, 0.9)


def test_what_all_begin_from_is_distilled_once(tmp_path: Path) -> None:
    said: list[tuple[str, ...]] = []
    ablations.teach(tmp_path, lambda *words: said.append(words))
    out = str(tmp_path / "taught")
    assert len(said) == 1 and said[0][:3] == ("distill", "sit", out)
    command = parse(list(said[0]))
    assert command.world.tracker == "track-sit" and command.dagger.minutes == 5.0
    (tmp_path / "taught").mkdir()
    (tmp_path / "taught" / "manifest.json").touch()
    ablations.teach(tmp_path, lambda *words: said.append(words))
    assert len(said) == 1


def test_rows_by_hand() -> None:
    """160 of 200 succeed: Wilson's interval is 73.9 to 85.0 %."""
    other = replace(DONE, seed=1, trials=100, fell=0.2, jerk=None, skating=3.0, skipped=None)
    page = ablations.rendered([DONE, other])
    cells = "80.0 | 73.9-85.0 | 80.0, 80.0 | 15.0 | 1.50 | 2.50 | 0.90 | 70 | 0 |"
    assert f"| {ALL} |  | {cells}" in page
    assert "22 of 24 trainings are not measured yet" in page
    assert "| 7 training pieces | `--world.pieces 7` |  |" in page


def test_a_call_goes_on_where_one_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is kept is not trained again; a run that has begun is resumed."""
    file = tmp_path / "ablations.json"
    file.write_text(json.dumps([asdict(DONE)]))
    asked: list[tuple[Row, int]] = []

    def made(row: Row, seed: int, folder: Path, inhabit: object) -> Trained:
        asked.append((row, seed))
        if len(asked) == 3:
            raise KeyboardInterrupt
        return replace(DONE, row=row.name, seed=seed)

    monkeypatch.setattr(ablations, "train", made)
    (tmp_path / ablations.TAUGHT).mkdir()
    (tmp_path / ablations.TAUGHT / "manifest.json").touch()  # what all begin from is there
    with pytest.raises(KeyboardInterrupt):
        ablations.main([str(tmp_path), "--file", str(file)])
    assert [(row.name, seed) for row, seed in asked] == [(row.name, 0) for row in ROWS[1:4]]
    assert [one.row for one in ablations.kept(file)] == [row.name for row in ROWS[:3]]
    assert ablations.missing(ablations.kept(file))[0] == (ROWS[3], 0)


def test_what_the_commands_write_is_what_is_kept(tmp_path: Path) -> None:
    run = tmp_path / "0-1"
    run.mkdir()
    (run / "config.json").write_text("{}")
    value = {"motion": 0.8, "mocap": 0.5, "ratio": 1.6}
    approach = dict.fromkeys(("jerk", "skating", "separability"), value)
    said: list[tuple[str, ...]] = []

    def inhabit(*words: str) -> None:
        said.append(words)
        if words[0] == "evaluate":
            result = {"trials": 1024, "success": {"rate": 0.75}, "falls": 0.125}
            Path(words[-1]).write_text(json.dumps(result))
        elif words[0] == "realism":
            Path(words[-1]).write_text(json.dumps({"phases": {"approach": {"values": approach}}}))
        else:
            run = Path(words[words.index("--run") + 1])
            run.mkdir(exist_ok=True)
            lines = [{"style/skipped": 1.0}, {"style/skipped": 0.0, "style/accuracy_policy": 0.6}]
            (run / "metrics.jsonl").write_text("\n".join(map(json.dumps, lines)))

    found = ablations.train(ROWS[0], 1, tmp_path, inhabit)
    assert found == Trained(ALL, 1, 1024, 768, 0.125, 1.6, 1.6, 0.8, 0.6, 0.5)
    assert [words[0] for words in said] == ["train", "evaluate", "realism"]
    # a run goes on from its own networks: the two flags together are refused
    assert "--resume" in said[0] and "--init" not in said[0]
    ablations.train(ROWS[0], 2, tmp_path, inhabit)
    assert said[3][said[3].index("--init") + 1] == str(tmp_path / "taught")
