"""The flags of teaching, as they are typed."""

from pathlib import Path

from console.app import parse
from console.commands import Distill
from console.commands.teaching import Dagger, Labelled


def test_words_become_settings() -> None:
    words = ["distill", "sit", "out", "--minutes", "5", "--batches", "9", "--noise", "0.1"]
    wanted = Distill("sit", Path("out"), Labelled(noise=0.1), Dagger(minutes=5.0, batches=9))
    assert parse(words) == wanted
    assert parse(["distill", "sit", "out", "--spell", "2", "3"]).dagger.spell == (2.0, 3.0)
    words = ["distill", "sit", "out", "--minutes", "5", "--world.walker", "walk"]
    found = parse(words)
    assert (found.task, found.out, found.world.walker) == ("sit", Path("out"), "walk")
    assert (found.dagger.minutes, found.dagger.spell) == (5.0, (10.0, 200.0))
