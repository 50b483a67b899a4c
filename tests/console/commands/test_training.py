"""The flags of training and of what follows a run, as they are typed."""

from pathlib import Path

from console.app import parse
from console.commands import Evaluate, Publish, Train, Video
from console.run.experiment import PRESETS


def test_a_preset_is_where_flags_begin() -> None:
    found = parse(["train", "sit", "--preset", "paper", "--ppo.gamma", "0.9"])
    assert isinstance(found, Train) and found.task == "sit"
    assert found.experiment.ppo.hidden == PRESETS["paper"].ppo.hidden == (1024, 512)
    assert found.experiment.ppo.gamma == 0.9
    assert parse(["train", "sit"]).experiment == PRESETS["fast"]


def test_words_become_settings() -> None:
    found = parse(["train", "lie", "--minutes", "2", "--style-service.address", "h:1"])
    assert (found.minutes, found.style_service.address) == (2.0, "h:1")
    found = parse(["evaluate", "run", "--trials", "8", "--near-m", "1", "--record", "r.msgpack"])
    assert found == Evaluate(Path("run"), trials=8, near_m=1.0, record=Path("r.msgpack"))
    found = parse(["publish", "run", "out", "--data", "d", "--licence", "l", "--average", "3"])
    assert found == Publish(Path("run"), Path("out"), data="d", licence="l", average=3)
    assert parse(["video", "run", "a.mp4"]) == Video(Path("run"), Path("a.mp4"))


def test_publishing_needs_neither_data_nor_licence() -> None:
    """The checkpoint names them."""
    assert parse(["publish", "run", "out"]) == Publish(Path("run"), Path("out"))
