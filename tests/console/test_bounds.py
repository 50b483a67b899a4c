"""Every number of every command has bounds: in its help, and refused beyond them, nan included."""

import dataclasses
import typing
from pathlib import Path
from typing import Any, get_args

import pytest

from console import bounds, commands
from console.app import main
from console.run.experiment import PRESETS
from world.errors import ConfigError

ENTRIES = (*commands.COMMANDS, *commands.MOTIONS, *commands.OBJECTS)


def kinds() -> set[type]:
    """The dataclasses of all commands and what they hold."""
    found: set[type] = set()

    def walk(hint: Any) -> None:
        if dataclasses.is_dataclass(hint) and isinstance(hint, type) and hint not in found:
            found.add(hint)
            for inner in typing.get_type_hints(hint).values():
                walk(inner)
        for inner in typing.get_args(hint):
            walk(inner)

    for entry in ENTRIES:
        walk(entry.flags)
    return found


FIELDS = sorted(
    ((kind, name) for kind in kinds() for name in bounds.numeric(kind)),
    key=lambda found: (found[0].__name__, found[1]),
)


def test_there_are_many_and_no_line_is_left_over() -> None:
    assert len(FIELDS) > 110
    known = {(kind.__name__, name) for kind, name in FIELDS}
    assert {(k, name) for k, names in bounds.BOUNDS.items() for name in names} == known


@pytest.mark.parametrize(("kind", "name"), FIELDS, ids=lambda x: getattr(x, "__name__", x))
def test_each_number_has_bounds(kind: type, name: str) -> None:
    assert bounds.text(kind, name)
    spans = bounds.BOUNDS[kind.__name__][name]
    field = next(f for f in dataclasses.fields(kind) if f.name == name)
    holder = dataclasses.make_dataclass(kind.__name__, [(name, Any)])
    if field.default is not dataclasses.MISSING:
        bounds.require(holder(field.default))
    low, high = spans[-1]
    for wrong in (float("nan"), float("inf"), float("-inf"), low - 1, 2 * high + 1):
        value = wrong if len(spans) == 1 else ((0.0, wrong),)
        for given in (value, (value,)) if len(spans) == 1 else (value,):
            with pytest.raises(ConfigError, match=f"^--{name.replace('_', '-')} .*: must be "):
                bounds.require(holder(given))


@pytest.mark.parametrize("preset", PRESETS)
def test_the_presets_are_within(preset: str) -> None:
    bounds.require(PRESETS[preset])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("train sit --threads 0", "--threads 0: must be 1 to 1024"),
        ("train sit --minutes nan", "--minutes nan: must be 0.001 to 1000000"),
        ("train sit --minutes -1", "--minutes -1: must be 0.001 to 1000000"),
        ("train sit --ppo.gamma 2", "--ppo.gamma 2: must be 0 to 1"),
        ("train sit --ppo.sigma 0 inf", "--ppo.sigma inf: must be"),
        (
            "train sit --ppo.sigma 20e6 0.02 0 0.03",
            "--ppo.sigma 20000000 0.02 0 0.03: the samples of a schedule ascend; give --ppo.sigma"
            " 0 0.03 20000000 0.02",
        ),
        ("train sit --ppo.clip 9 0.1 8 0.2", "--ppo.clip 9 0.1 8 0.2: the samples of a schedule"),
        ("train sit --ppo.kl-target 9 0.1 8 0.2", "--ppo.kl-target 9 0.1 8 0.2: the samples of"),
        ("train sit --ppo.sigma", "--ppo.sigma: give SAMPLES VALUE, once or more"),
        ("train sit --world.scale 0 1", "--world.scale 0: must be 0.1 to 10"),
        ("train sit --world.initial.near 7", "--world.initial.near 7: must be 0 to 1"),
        ("serve x --batch.max-rows 0", "--batch.max-rows 0: must be 1 to 65536"),
        ("serve x --poll-s nan", "--poll-s nan: must be 0.05 to 3600"),
        ("evaluate x --trials -5", "--trials -5: must be 1 to 10000000"),
        ("evaluate x --seed -1", "--seed -1: must be 0 to 9223372036854775807"),
        ("evaluate x --seed 99999999999999999999", "--seed 99999999999999999999: must be"),
        ("train sit --ppo.gamma 1.0000001", "--ppo.gamma 1.0000001: must be 0 to 1"),
        ("video x --width 100000000", "--width 100000000: must be 16 to 8192"),
        ("video x --width 0", "--width 0: must be 16 to 8192"),
        ("bench world --seconds nan", "--seconds nan: must be 0.1 to 1000000"),
        ("objects show --limit 0", "--limit 0: must be 1 to 100000"),
    ],
)
def test_beyond_them_is_a_mistake_of_the_command_line(
    words: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words.split()) == 2
    err = capsys.readouterr().err
    assert said in err and err.count("\n") == 1


def test_a_schedule_may_jump() -> None:
    holder = dataclasses.make_dataclass("LearnerConfig", [("sigma", object)])
    bounds.require(holder(((0.0, 0.03), (1e6, 0.03), (1e6, 0.02))))
    bounds.require(holder(((5.0, 0.03),)))


@pytest.mark.parametrize("where", ["[settings]", "settings"])
def test_a_recipe_s_schedules_ascend_too(
    where: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = "{ 'ppo.sigma' = [[20e6, 0.02], [0, 0.03]] }"
    whole = where == "[settings]"
    path = tmp_path / "mine.toml"
    path.write_text(
        ("[settings]\n'ppo.sigma' = [[20e6, 0.02], [0, 0.03]]\n" if whole else "")
        + "[[stage]]\nname = 'a'\nends = { success = { near = 0.5 }, limit = 9 }\n"
        + ("" if whole else f"settings = {table}\n")
    )
    assert main(["train", "sit", "--recipe", str(path), "--dry-run"]) == 2
    err = capsys.readouterr().err
    assert "--ppo.sigma 20000000 0.02 0 0.03: the samples" in err and err.count("\n") == 1
    assert whole or "stage a" in err


@pytest.mark.parametrize("word", ["train", "serve", "evaluate"])
def test_help_lists_the_bounds(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word, "--help-all"]) == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    wanted = {"train": "1 to 1024", "serve": "1 to 65536", "evaluate": "1 to 10000000"}[word]
    assert wanted in text


def test_fields_whose_flags_have_no_prefix_are_known() -> None:
    """Messages name flags as they are typed."""
    for kind in kinds():
        hints = typing.get_type_hints(kind, include_extras=True)
        for field in dataclasses.fields(kind):
            names = [getattr(one, "name", None) for one in get_args(hints[field.name])[1:]]
            held = typing.get_type_hints(kind)[field.name]
            if dataclasses.is_dataclass(held):
                assert ("" in names) == (field.name in bounds.UNNAMED), (kind, field.name)


RANGES = sorted(
    ((kind, name) for kind in kinds() for name in bounds.ranges(kind)),
    key=lambda found: (found[0].__name__, found[1]),
)


@pytest.mark.parametrize(("kind", "name"), RANGES, ids=lambda x: getattr(x, "__name__", x))
def test_the_least_of_a_range_comes_first(kind: type, name: str) -> None:
    low, high = bounds.BOUNDS[kind.__name__][name][0]
    values = (low + (high - low) / 4, low + (high - low) / 2)
    pair = tuple[float, float]
    holder = dataclasses.make_dataclass(kind.__name__, [(name, pair)])
    bounds.require(holder(values))
    bounds.require(holder((low, low)))
    with pytest.raises(ConfigError, match=rf"^--{name.replace('_', '-')} .*: the first is the le"):
        bounds.require(holder(values[::-1]))


def test_there_are_ranges_and_one_is_refused_dry(capsys: pytest.CaptureFixture[str]) -> None:
    assert len(RANGES) >= 12
    assert main(["train", "sit", "--dry-run", "--world.scale", "1.2", "0.8"]) == 2
    assert "--world.scale 1.2 0.8: the first is the least" in capsys.readouterr().err
    words = "--world.initial.reference 0 --world.initial.near 0 --world.initial.far 0"
    assert main(f"train sit --dry-run {words}".split()) == 2
    assert "are all 0" in capsys.readouterr().err


@pytest.mark.parametrize(
    "settings", ["--ppo.sigma 0 0", "--ppo.sigma 0 0.05 1e6 0", "--ppo.observation-std-floor 0"]
)
def test_numbers_that_are_divided_by_are_above_0(
    settings: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without noise no action has a density; without a floor a constant feature is no number."""
    assert main(["train", "sit", "--dry-run", *settings.split()]) == 2
    assert "0: must be " in capsys.readouterr().err
