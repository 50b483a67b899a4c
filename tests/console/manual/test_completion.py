"""The scripts complete in real shells; a shell that is not installed is skipped."""

import json
import os
import pty
import shutil
import subprocess
from pathlib import Path
from typing import get_args

import pytest

import pretrained
from console import commands
from console.app import main
from console.commands import Shell
from console.manual import completion, page
from world.tasks import REGISTRY


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder below that of the scripts, with a run, a folder that is none, and a recording."""
    folder = tmp_path_factory.mktemp("shells") / "place"
    folder.mkdir()
    for shell in get_args(Shell):
        (folder.parent / f"script.{shell}").write_text(completion.script(shell))
    (folder / "runs" / "first").mkdir(parents=True)
    (folder / "runs" / "other").mkdir()
    (folder / "runs" / "first" / "config.json").write_text(json.dumps({}))
    (folder / "a.msgpack").touch()
    return folder


POLICIES = set(pretrained.names())
#: The words of a command line, and what completes the last of them.
ASKED: list[tuple[list[str], set[str]]] = [
    (["mot"], {"motions"}),
    (["motions", ""], {"import", "list", "check", "play", "vary"}),
    (["train", ""], set(REGISTRY)),
    (["train", "sit", "--preset", ""], {"fast", "paper", "track", "finetune"}),
    (["train", "sit", "--preset", "p"], {"paper"}),
    (["train", "sit", "--objects", "te"], {"test"}),
    (["train", "--seed", "3", "w"], {"walk"}),
    (["train", "sit", "--resume", "--pre"], {"--preset"}),
    (["train", "sit", "--world.no-mi"], {"--world.no-mirror"}),
    (["train", "sit", "--scenes", ""], set()),
    (["evaluate", "runs/first", "--perturb", "m"], {"moved"}),
    (["evaluate", "--trials", "9", "s"], {"sit", "sit-free"} & POLICIES),
    (["objects", "check", "x.obj", "--unit", ""], {"m", "cm", "mm", "in", "ft"}),
    (["completion", ""], {"bash", "zsh", "fish"}),
    (["bench", "wo"], {"world"}),
]
#: In bash a folder ends in a slash, so that the next Tab goes on inside.
RUNS = POLICIES | {"runs/", "runs/first/", "a.msgpack"}


def in_bash(place: Path, *words: str) -> set[str]:
    """What bash itself completes: it parts words at `=` and `:` as at the Tab key."""
    script = """
    cd "$1"; source ../script.bash; shift
    COMP_WORDS=(inhabit "$@"); COMP_CWORD=$#; COMPREPLY=()
    _inhabit; printf '%s\\n' "${COMPREPLY[@]}"
    """
    done = subprocess.run(
        ["bash", "--norc", "-c", script, "bash", str(place), *words],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert not done.stderr
    return {line for line in done.stdout.splitlines() if line}


@pytest.mark.parametrize(("words", "wanted"), ASKED, ids=lambda x: " ".join(x) or "none")
def test_bash_completes(place: Path, words: list[str], wanted: set[str]) -> None:
    assert in_bash(place, *words) == wanted


def test_bash_completes_runs_policies_and_files(place: Path) -> None:
    for words in (["evaluate", ""], ["train", "sit", "--init", ""], ["play", "sit", ""]):
        assert in_bash(place, *words) == RUNS
    assert in_bash(place, "evaluate", "runs/f") == {"runs/first/"}
    assert in_bash(place, "play", "sit", "a") == {"a.msgpack"}


def test_bash_completes_behind_an_equals_sign(place: Path) -> None:
    assert in_bash(place, "train", "sit", "--preset", "=", "p") == {"paper"}
    assert in_bash(place, "train", "sit", "--preset", "=") == {"fast", "paper", "track", "finetune"}
    assert in_bash(place, "train", "sit", "--preset", "=", "fast", "--runner", "l") == {"local"}


def test_bash_knows_every_command_and_flag(place: Path) -> None:
    top = in_bash(place, "")
    assert top == {entry.name for entry in (*commands.COMMANDS, *commands.GROUPS)}
    for command in completion.all_commands():
        found = in_bash(place, *command.name.split(), "-")
        assert found == {f.typed for f in command.flags} | {"--help", "--help-all"}


def test_bash_at_the_tab_key(place: Path) -> None:
    """An interactive shell in which the Tab key is pressed; the completed line is run."""
    (place.parent / "rc").write_text('source ../script.bash; inhabit() { echo RUN "$@"; }; PS1=\n')
    main_end, shell_end = pty.openpty()
    with subprocess.Popen(
        ["bash", "--rcfile", "../rc", "-i"],
        stdin=shell_end, stdout=shell_end, stderr=shell_end, cwd=place, start_new_session=True,
        env=os.environ | {"TERM": "dumb", "HOME": str(place), "INPUTRC": "/dev/null"},
    ) as shell:  # fmt: skip
        os.close(shell_end)
        os.write(main_end, b"inhabit tra\tsit --pres\tpa\t--run=runs/fi\t\nexit\n")
        text = b""
        while part := _read(main_end):
            text += part
    os.close(main_end)
    assert shell.returncode == 0
    ran = next(line for line in text.decode().splitlines() if line.startswith("RUN"))
    assert ran.split() == ["RUN", "train", "sit", "--preset", "paper", "--run=runs/first/"]


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # the shell has ended
        return b""


@pytest.mark.skipif(shutil.which("fish") is None, reason="fish is not installed here")
@pytest.mark.parametrize(("words", "wanted"), ASKED, ids=lambda x: " ".join(x) or "none")
def test_fish_completes(place: Path, words: list[str], wanted: set[str]) -> None:
    line = " ".join(["inhabit", *words])
    done = subprocess.run(
        ["fish", "--no-config", "-c", f"source ../script.fish; complete -C '{line}'"],
        capture_output=True, text=True, cwd=place,
    )  # fmt: skip
    found = {row.split("\t")[0] for row in done.stdout.splitlines()}
    # where no word begins with the letters, fish offers those that hold them
    assert {word for word in found if word.startswith(words[-1])} == wanted


ZSH = """
compdef() { :; }
_files() { print -l -- *(N); }
compset() { :; }
compadd() {
  local -a found
  while (( $# )); do
    case $1 in
      -l) ;; -d|-S) shift ;; -a) shift; found+=("${(@P)1}") ;; --) ;; *) found+=("$1") ;;
    esac
    shift
  done
  print -l -- "${found[@]}"
}
source ../script.zsh
words=(inhabit "$@"); CURRENT=${#words}; _inhabit
"""


@pytest.mark.skipif(shutil.which("zsh") is None, reason="zsh is not installed here")
@pytest.mark.parametrize(("words", "wanted"), ASKED, ids=lambda x: " ".join(x) or "none")
def test_zsh_completes(place: Path, words: list[str], wanted: set[str]) -> None:
    """With stand-ins of the functions that exist at the Tab key alone, which choose by the letters
    typed so far."""
    done = subprocess.run(
        ["zsh", "-f", "-c", ZSH, "zsh", *words], capture_output=True, text=True, cwd=place
    )
    assert not done.stderr
    assert {row for row in done.stdout.splitlines() if row.startswith(words[-1])} >= wanted


def test_scripts_of_zsh_and_fish_hold_every_flag_with_its_meaning(place: Path) -> None:
    """Where neither shell is installed."""
    for shell in ("zsh", "fish"):
        text = (place.parent / f"script.{shell}").read_text()
        assert not [mark for mark in ("#COMMANDS#", "#FLAGS#", "#VALUES#") if mark in text]
        for command in completion.all_commands():
            for flag in command.flags:
                assert f"{flag.typed}\t{page.first_sentence(flag.meaning)[:12]}" in text


def test_the_command_prints_the_script(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bash"]) == 0
    assert capsys.readouterr().out == (place.parent / "script.bash").read_text()
    assert main(["completion", "tcsh"]) == 2
    assert "bash" in capsys.readouterr().err
