"""`inhabit video`: what is refused before anything is drawn, and how much of a recording is."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from console.app import main
from console.commands import Video
from console.recording import format as recording
from console.recording.format import Recording
from console.video import command, rendering
from tests.support.console.recordings import take
from world.errors import ConfigError


def test_something_must_be_asked_for() -> None:
    with pytest.raises(ConfigError, match=r"nothing to write: give OUT\.mp4"):
        command.video_command(Video(Path("x")))
    with pytest.raises(ConfigError, match="--trials must be at least 1"):
        command.video_command(Video(Path("x"), Path("a.mp4"), trials=0))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("a.mp4 --width 321", "--width 321: an .mp4 needs even sizes; give 322"),
        (
            "a.mp4 --near-m 5 --far-m 1",
            "--near-m 5 --far-m 1: the first must be above 0, the second no less",
        ),
        ("a.mp4 --height 241", "--height 241: an .mp4 needs even sizes; give 242"),
    ],
)
def test_a_film_has_the_size_and_the_distances_asked_for(
    words: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The encoder takes even sizes alone: it had made another, and warned in its own words."""
    name, *flags = words.split()
    assert main(["video", "sit", str(tmp_path / name), *flags]) == 2
    assert capsys.readouterr().err == f"inhabit: {said}\n"


@pytest.mark.parametrize(
    ("flag", "value"),
    [("seconds", 3.0), ("objects", "train"), ("near_m", 1.0), ("far_m", 2.0), ("seed", 1)],
)
def test_a_recording_has_its_trials(
    flag: str, value: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.msgpack"
    recording.write(path, Recording([take()], {}))
    monkeypatch.setattr(rendering, "require_gl", lambda: None)
    worked: list[Any] = []
    monkeypatch.setattr(rendering, "write_video", lambda *a, **k: worked.append(a))
    monkeypatch.setattr(command.tracking, "shown", lambda *a: worked.append(a))
    words = replace(Video(path, tmp_path / "a.mp4"), **{flag: value})
    named = f"--{flag.replace('_', '-')} {value}: .*r.msgpack is a recording, .* by --trials"
    with pytest.raises(ConfigError, match=named):
        command.video_command(words)
    words = replace(words, source=Path("track"))
    with pytest.raises(ConfigError, match="track is a policy that follows clips"):
        command.video_command(words)
    assert worked == []


def test_a_recording_is_drawn_up_to_the_trials_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "r.msgpack"
    recording.write(path, Recording([take()] * 3, {}))
    drawn = []

    def film(found: Recording, out: Path, look: Any, progress: Any, threads: int | None) -> int:
        drawn.append((len(found.takes), out, look.width, look.shapes, threads))
        return 7

    monkeypatch.setattr(rendering, "require_gl", lambda: None)
    monkeypatch.setattr(rendering, "write_video", film)
    words = Video(path, tmp_path / "a.mp4", trials=2, width=320, look="shapes", threads=3)
    assert command.video_command(words) == 0
    assert drawn == [(2, tmp_path / "a.mp4", 320, "shapes", 3)]
    assert "7 frames, 2 trials" in capsys.readouterr().out
