"""The flags of files for animation programs, as they are typed for both commands."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands.animation import AnimationFlags


@pytest.mark.parametrize(
    "words", [["export", "a.msgpack", "a.glb"], ["synthesize", "run", "--out", "a.glb"]]
)
def test_both_commands_have_them(words: list[str]) -> None:
    assert parse(words).files == AnimationFlags()
    more = ["--rest", "t-pose", "--root-motion", "--rig", "r.glb", "--joint-map", "m.json"]
    assert parse([*words, *more]).files == AnimationFlags(
        "t-pose", True, Path("r.glb"), Path("m.json")
    )


def test_a_rest_has_a_name() -> None:
    with pytest.raises(Exception, match="--rest"):
        parse(["export", "a.msgpack", "a.bvh", "--rest", "a-pose"])
