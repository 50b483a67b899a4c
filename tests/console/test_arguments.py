"""Words that are no command: exit code 2 and one line that names what would be."""

import re
from importlib import metadata

import pytest

from console.app import main
from console.run.renamed import REPEATED
from world.tasks import REGISTRY

WRONG = [
    ("", "a command is missing: choose one of train, evaluate"),
    ("--frobnicate", "--frobnicate: no flag of inhabit; choose one of train, evaluate"),
    ("frobnicate", "frobnicate: no command of inhabit: choose one of train, evaluate"),
    ("dance --help", "dance: no command of inhabit: choose one of train, evaluate"),
    ("motions lits --help", "lits: no command of inhabit motions: choose one of import, list, ch"),
    ("train fly --help", "unknown task 'fly': choose one of carry, lie, sit, track, walk"),
    ("train sit --world.motions a", "--world.motions is set by --motions: use that"),
    ("train sit --world.task=lie", "--world.task is set by the word TASK: use that"),
    ("train sit --ppo.threads 2", "--ppo.threads is set by --threads: use that"),
    ("train", "TASK"),
    ("train sit --scnes 4",
     "--scnes: no flag of inhabit train; perhaps --scenes; see inhabit train --help"),
    ("train sit --batch.max-rows 0",
     "--batch.max-rows: no flag of inhabit train; see inhabit train --help"),
    ("evaluate sit --no-json", "--no-json: no flag of inhabit evaluate; perhaps --json; see"),
    ("evaluate sit lie", "lie: a word too many for inhabit evaluate; see"),
    ("train sit --runner cloud", "--runner cloud: choose one of local, ray; see"),
    ("train sit --preset big", "--preset big: choose one of fast, paper, track, finetune; see"),
    ("motions import a --out b --unit yard", "--unit yard: choose one of cm, ft, in, m, mm; see"),
    ("train sit --scenes many", "--scenes many: must be a whole number, 1 to 1000000; see"),
    ("train sit --threads 1.5", "--threads 1.5: must be a whole number, 1 to 1024; see"),
    ("evaluate sit --near-m near", "--near-m near: must be a number, 0 to 100; see"),
    ("train sit --ppo.hidden 9 a", "--ppo.hidden 9 a: must be whole numbers, 1 to 16384; see"),
    ("train sit --ppo.clip nan", "--ppo.clip nan: must be pairs of numbers, 0 to 1e+15, 0 to 1"),
    ("train sit --world.scale 1 b", "--world.scale 1 b: must be 2 numbers, 0.1 to 10; see"),
    ("train sit --scenes", "--scenes: needs a value; see"),
    ("train sit --world.scale 1", "--world.scale: needs 2 values; see"),
    ("export sit", "FILE: missing: FILE.onnx of a policy; FILE.glb, .gltf, .bvh or .smpl.npz of a"
     " motion; see inhabit export --help"),
    ("publish", "RUN|CHECKPOINT|NAME, DIR: missing; see inhabit publish --help"),
    ("completion", "a word is missing: choose one of bash, zsh, fish; see"),
    ("bench", "a word is missing: choose one of world, servos, furniture, box, learner, style,"
     " serve, train, endurance, scaling, fuzz, peers, learning, profile, films; see"),
    ("bench furniture --objects", "--objects: name train, test, all or a path of pieces"),
    ("bench worlds", "worlds: choose one of world, servos, furniture, box, "),
    ("motions lits", "lits: no command of inhabit motions: choose one of import, list, check"),
    ("motions", "a command is missing: choose one of import, list, check"),
    ("motions --lits", "--lits: no flag of inhabit motions; choose one of import, list, check"),
    ("objects", "import, list, check, show"),
    ("objects lits", "lits: no command of inhabit objects: choose one of import, list, check, sh"),
]  # fmt: skip


@pytest.mark.parametrize("columns", ["80", "200"])
@pytest.mark.parametrize(("words", "named"), WRONG, ids=[words or "none" for words, _ in WRONG])
def test_one_line_names_the_choices(
    words: str,
    named: str,
    columns: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", columns)  # where tyro's box would wrap
    assert main(words.split()) == 2
    out, err = capsys.readouterr()
    assert not out and err.startswith("inhabit: ") and err.count("\n") == 1
    assert named in err


@pytest.mark.parametrize("words", ["--help", "train --help", "motions --help", "objects --help"])
def test_help_is_0_and_on_standard_output(words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words.split()) == 0
    out, err = capsys.readouterr()
    assert "usage: inhabit" in out and not err


def help_of(words: str, capsys: pytest.CaptureFixture[str]) -> str:
    """All flags."""
    assert main([*words.split(), "--help-all"]) == 0
    return capsys.readouterr().out


def flags_of(text: str) -> list[str]:
    """The flags of a help text, in its order; further lines of a text are indented more."""
    return re.findall(r"^(?:│ |  )(--[a-z][-a-z.]*)", text, re.MULTILINE)


def test_the_help_of_a_task_has_its_own_settings(capsys: pytest.CaptureFixture[str]) -> None:
    found = {task: set(flags_of(help_of(f"train {task}", capsys))) for task in REGISTRY}
    furniture = {
        "--objects", "--world.pieces", "--world.scales", "--world.scale", "--world.seed",
        "--world.initial.raised-seat-fraction", "--world.initial.front-m",
        "--world.initial.focus",
    }  # fmt: skip
    shared = found["walk"]
    assert found["lie"] == found["sit"] == shared | furniture
    assert not shared & furniture
    for task, more in (("carry", {"--world.initial.focus"}), ("track", set())):
        own = found[task] - shared - more
        assert own and all(flag.startswith(f"--world.{task}.") for flag in own)
        assert more <= found[task]
    states = {flag for flag in shared if flag.startswith("--world.initial.")}
    assert shared - found["track"] == states != set()  # clips alone begin its episodes
    assert not shared - found["carry"]
    # without a task, those of every task
    assert set(flags_of(help_of("train", capsys))) == set().union(*found.values())


def test_no_setting_has_two_flags(capsys: pytest.CaptureFixture[str]) -> None:
    flags = flags_of(help_of("train track", capsys))
    assert len(flags) == len(set(flags))
    assert not {f"--{key.replace('_', '-')}" for key in REPEATED} & set(flags)
    for words in ("objects check", "motions play", "evaluate"):
        text = help_of(words, capsys)
        assert "--no-json" not in text and "--no-debug" not in text


def test_a_flag_that_turns_off_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    text = " ".join(help_of("motions play", capsys).split())
    assert "--no-open Turns off: Open the browser." in text


def test_the_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"inhabit {metadata.version('inhabit')}\n"
