"""The demo's command: which policies it takes, what it says is missing, and what it refuses."""

from pathlib import Path

import pytest

import pretrained
from console.app import main
from console.demo.command import missing, policies
from world.errors import ConfigError


def test_every_shipped_policy_is_there_and_a_named_one_replaces_that_of_its_task(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(pretrained, "names", lambda: ["carry", "walk"])
    found = policies([str(pretrained.ROOT / name) for name in ("walk", "sit")])
    assert list(found) == ["carry", "walk", "sit"]
    assert all(served.task.name == task for task, served in found.items())


def test_of_two_policies_of_a_task_it_plays_the_one_that_anyone_may_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for names in (["sit", "sit-free"], ["sit-free", "sit"]):
        monkeypatch.setattr(pretrained, "names", lambda names=names: names)
        licence = policies(())["sit"].manifest.notes["licence"]
        assert licence.startswith("Apache-2.0")


def test_a_room_has_one_policy_of_each_task() -> None:
    with pytest.raises(ConfigError, match=r"^sit and sit-free are both policies of sit: .* leave"):
        policies(["sit", "walk", "sit-free"])
    with pytest.raises(ConfigError, match=r"^track follows clips, .* of sit, lie, carry, walk$"):
        policies(["walk", "track"])


def test_what_is_missing_and_how_to_get_it() -> None:
    assert missing(["sit", "lie", "carry", "walk"]) == ""
    text = missing(["carry", "walk"])
    assert text.startswith("*Not here: sit and lie.") and "inhabit train sit" in text
    assert "track" not in text, "follows clips"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["nowhere"], 2, "nowhere: no such run"),
        (
            ["track"],
            2,
            "track follows clips, of which a room has none: choose policies of sit, lie",
        ),
        (["--seed", "-1"], 2, "--seed -1: must be 0"),
        (["--listen", "0.0.0.0:0"], 2, "--allow-insecure-remote"),
        (["--listen", "nowhere"], 2, "HOST:PORT"),
    ],
)
def test_it_refuses_in_a_line(
    words: list[str],
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["demo", *words, "--no-open"]) == code
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
