"""The flags of teaching, as they are typed."""

from pathlib import Path

from console.app import parse
from console.commands import TeachCarry, TeachRecord, TeachTry
from console.commands.teaching import Dagger, Practice


def test_words_become_settings() -> None:
    words = ["teach", "carry", "out", "--minutes", "5", "--batches", "9", "--in-hand", "0.5"]
    wanted = TeachCarry(Path("out"), Practice(in_hand=0.5), Dagger(minutes=5.0, batches=9))
    assert parse(words) == wanted
    assert parse(["teach", "carry", "out", "--spell", "2", "3"]).dagger.spell == (2.0, 3.0)
    assert parse(["teach", "try", "--noise", "0.1", "--json"]) == TeachTry(noise=0.1, json=True)
    assert parse(["teach", "record", "out", "--clips", "3"]) == TeachRecord(Path("out"), 3)
    words = ["distill", "sit", "out", "--minutes", "5", "--world.walker", "walk"]
    found = parse(words)
    assert (found.task, found.out, found.world.walker) == ("sit", Path("out"), "walk")
    assert (found.dagger.minutes, found.dagger.spell) == (5.0, (10.0, 200.0))
