"""Turns in alternation, their figures by hand, and the lines for peers that are missing."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from console.app import main
from console.bench.peers import alternation, pools
from console.bench.peers.alternation import PeerError, Start
from console.bench.peers.figures import FLEETS, figures_of, fleet_figures, pool_figures
from console.bench.peers.protocol import Assignment, Turn
from console.bench.peers.registry import NAMES, OURS, OURS_TASK, PEERS, SCENES
from console.commands import Bench
from console.run.experiment import PRESETS
from world.errors import ChoiceError, ConfigError

HERE = Path(sys.executable)


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "turns"
    monkeypatch.setenv("STAND_IN_TURNS", str(path))
    return path


def start(name: str, seed: int = 1) -> Start:
    assignment = Assignment(replace(PRESETS["fast"], seed=seed), 1)
    return Start(name, "tests.support.peers.stand_in", HERE, assignment.to_json())


def test_rounds_go_there_and_back(log: Path) -> None:
    starts = [start(OURS), start("skrl", 10), start("torchrl", 20)]
    turns = alternation.alternate(starts, 0.25, 3)
    assert {name: [turn.samples for turn in taken] for name, taken in turns.items()} == {
        name: [100, 200, 300] for name in (OURS, "skrl", "torchrl")
    }
    taken = [line.split()[1:] for line in log.read_text().splitlines()]
    assert [int(seed) for seed, _ in taken] == [1, 10, 20, 20, 10, 1, 1, 10, 20]
    assert {seconds for _, seconds in taken} == {"0.25"}


@pytest.mark.parametrize(
    ("seed", "said"), [(2, "MemoryError: out of scenes"), (3, "no such accelerator")]
)
def test_a_peer_that_fails_is_left_out_by_name(log: Path, seed: int, said: str) -> None:
    notes: list[str] = []
    turns = alternation.alternate([start(OURS), start("skrl", seed)], 0.0, 2, notes.append)
    assert set(turns) == {OURS} and len(turns[OURS]) == 2
    (line,) = notes
    assert line.startswith("skrl: not measured: ") and line.endswith(f"exit code 1: {said}")


def test_without_ours_nothing_is_compared(log: Path) -> None:
    with pytest.raises(PeerError, match="no such accelerator"):
        alternation.alternate([start(OURS, 3), start("skrl")], 0.0, 2)


def turn(samples: int, processor_s: float = 1.0, peak_gb: float = 1.0) -> Turn:
    return Turn(samples, 2.0, processor_s, 1, peak_gb / 2, peak_gb)


def test_ratios_by_hand() -> None:
    turns = {
        OURS: [turn(300), turn(300), turn(300)],
        # the machine is slower in the last round, for all
        OURS_TASK: [turn(400, 1.0), turn(600, 2.0), turn(100, 0.5)],
        "skrl": [turn(200, 1.0, 3.0), turn(200, 1.0, 5.0), turn(50, 0.5, 4.0)],
        "rllib": [turn(100), turn(100), turn(20)],
        SCENES: [turn(800, 1.0), turn(600, 1.0), turn(400, 1.0)],
    }
    found = figures_of(turns)
    # ratios 2, 3 and 2; quartiles between the middle and its neighbours
    assert found["inhabit_task_to_skrl_ratio"] == found["to_best_ratio"] == 2.0
    assert found["inhabit_task_to_skrl_ratio_quartile_low"] == 2.0
    assert found["inhabit_task_to_skrl_ratio_quartile_high"] == 2.5
    # samples per processor second: 400/200, 300/200, 200/100
    assert found["inhabit_task_to_skrl_processor_ratio"] == 2.0
    assert found["inhabit_task_to_rllib_ratio"] == found["to_rllib_ratio"] == 5.0
    assert found["inhabit_to_skrl_ratio"] == 1.5
    # of the scenes' 800, 600 and 400 samples per processor second: 400, 300 and 200
    assert found["inhabit_task_of_scenes_processor_ratio"] == 0.5
    assert not any(f"to_{SCENES}" in name for name in found), "the scenes are no peer"
    assert found["skrl_samples_per_s"] == 100.0
    assert found["inhabit_task_processor_us_per_sample"] == pytest.approx(1e6 / 300)
    assert found["skrl_peak_gb"] == 5.0 and found["skrl_resident_gb"] == 2.5
    assert (found["goal_to_best_ratio"], found["goal_to_rllib_ratio"]) == (1.5, 5.0)
    without = figures_of({k: v for k, v in turns.items() if k != "rllib"})
    assert not any("rllib" in name for name in without)


def test_interpreters_are_named_by_peer(tmp_path: Path) -> None:
    found = alternation.interpreters_of([f"skrl={HERE}"])
    assert list(found) == [*NAMES, "unilab"] and set(found.values()) == {HERE}
    link = tmp_path / "python"
    link.symlink_to(HERE)
    found = alternation.interpreters_of([f"skrl={link}"])
    assert found["skrl"] == link, "a virtual environment is its link"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["skrl"], "--peer-python skrl: must be NAME=PATH"),
        (["skrl="], "--peer-python skrl=: must be NAME=PATH"),
        (["skrl=/nowhere/python"], "no interpreter at /nowhere/python"),
        (["skrl=/"], "no interpreter at /"),
        ([f"skrl={HERE}", f"skrl={HERE}"], "--peer-python skrl: given twice"),
    ],
)
def test_interpreters_that_are_none_are_refused(words: list[str], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        alternation.interpreters_of(words)


def test_a_peer_that_is_none_is_refused_with_the_choices() -> None:
    with pytest.raises(ChoiceError, match=r"skrll.*rllib, rsl_rl, skrl, torchrl, unilab"):
        alternation.interpreters_of([f"skrll={HERE}"])


def interpreter(path: Path, versions: dict[str, str]) -> Path:
    """A program that answers for the version of a package, as an interpreter does."""
    cases = "".join(f"  {name}) echo {version};;\n" for name, version in versions.items())
    path.write_text(f'#!/bin/sh\ncase "$3" in\n{cases}  *) exit 1;;\nesac\n')
    path.chmod(0o755)
    return path


RLLIB = ("gymnasium", "pyarrow", "dm_tree")
WHOLE = {peer.distribution: peer.version for peer in PEERS} | dict.fromkeys(RLLIB, "1")


def test_missing_peers_are_named_with_how_to_install_them(tmp_path: Path) -> None:
    some = interpreter(tmp_path / "some", {"skrl": "2.1.1", "torchrl": "0.13.0", "ray": "2.60.0"})
    notes: list[str] = []
    found = alternation.installed(dict.fromkeys(NAMES, some), notes.append)
    assert found == {"skrl": "2.1.1", "torchrl": "0.13.0"}, "Ray alone is not RLlib"
    assert notes[0] == "TorchRL 0.13.0: not the pinned version 0.14.1"
    for title, line in zip(("rsl_rl", "RLlib"), notes[1:], strict=True):
        assert line == (
            f"{title}: not measured: not installed in {some}: pip install 'inhabit[peers]', or"
            " --peer-python NAME=PATH of an interpreter that has it"
        )
    notes.clear()
    whole = interpreter(tmp_path / "whole", WHOLE)
    found = alternation.installed(dict.fromkeys(NAMES, whole), notes.append)
    assert list(found) == list(NAMES) and not notes


def test_without_any_peer_the_command_says_how_to_install_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    none = interpreter(tmp_path / "none", {})
    words = [f"{name}={none}" for name in NAMES]
    assert main(["bench", "peers", "--peer-python", *words]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "not installed: rsl_rl, skrl, torchrl, rllib: pip install 'inhabit[peers]'" in line


def test_flags_are_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[object] = []
    monkeypatch.setattr(alternation, "measure", lambda *a, **k: given.append((a, k)))
    command = Bench("peers", seconds=3.0, rounds=4, peer_python=("skrl=x",), fleet_actors=(2,))
    preset = PRESETS["fast"]
    alternation.from_flags(command, preset, 2)
    assert given == [((preset, 2, 3.0, 4, ("skrl=x",)), {"actors": (2,)})]


def test_one_round_has_no_spread(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "peers", "--rounds", "1"]) == 2
    assert "--rounds 1: must be 2 or above" in capsys.readouterr().err


def test_details_name_what_was_measured(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The assignments: ours whole and with the task reward alone, the peers with the latter."""
    whole, given = interpreter(tmp_path / "whole", WHOLE), {}

    def alternate(starts: list[Start], *_: object) -> dict[str, list[Turn]]:
        given.update({one.name: one for one in starts})
        return {one.name: [turn(100), turn(200)] for one in starts if one.name != "torchrl"}

    monkeypatch.setattr(alternation, "alternate", alternate)
    words = [f"{name}={whole}" for name in NAMES]
    _, details = alternation.measure(PRESETS["fast"], 2, 1.0, 2, words)
    assert list(given) == [OURS, OURS_TASK, SCENES, *NAMES]
    style = {name: one.first["experiment"]["ppo"]["style_weight"] for name, one in given.items()}
    assert style == {OURS: 0.4} | dict.fromkeys([OURS_TASK, SCENES, *NAMES], 0.0)
    assert all(one.first["experiment"]["ppo"]["warmup_iterations"] == 0 for one in given.values())
    assert set(details["peers"]) == {"rsl_rl", "skrl", "rllib"}
    assert details["peers"]["skrl"]["installed"] == "2.1.1"
    assert len(details["turns"][OURS]) == details["rounds"] == 2
    json.dumps(details)


def test_lines_of_code_leave_out_words() -> None:
    source = (
        '"""A module."""\n\nimport os  # why\n\n# a comment\n\n\ndef f():\n    """Say.\n\n'
        '    More.\n    """\n    return os.path.join(\n        "a",\n        "b",\n    )\n'
    )
    # import, def, and four lines of the return
    assert alternation.code_lines(source) == 6


def test_figures_of_the_pools_by_hand() -> None:
    taken = {
        pools.OURS: [turn(300, 1.0), turn(200, 1.0)],
        pools.UNILAB: [turn(150, 1.0), turn(200, 1.0)],
    }
    found = pool_figures(taken, 1e-12)
    assert found["pool_to_unilab_ratio"] == found["pool_to_unilab_processor_ratio"] == 1.5
    assert found["unilab_pool_control_steps_per_s"] == 87.5
    assert found["pool_state_difference"] == 1e-12
    assert pool_figures({}, 0.0) == {}


def test_fleets_are_compared_by_their_number_of_actors(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A number with which one of both fails is left out."""
    made: list[tuple[str, int]] = []
    real = alternation.Start

    def stand_in(name: str, module: str, interpreter: Path, first: dict[str, object]) -> Start:
        threads = int(str(first["threads"]))
        made.append((module, threads))
        fails = threads == 4 and name.startswith(FLEETS)
        given = start(name, 3 if fails else 1).first
        return real(name, "tests.support.peers.stand_in", interpreter, given)

    monkeypatch.setattr(alternation, "Start", stand_in)
    notes: list[str] = []
    task = Assignment(PRESETS["fast"], 2)
    found = alternation.ray_fleets(task, HERE, (1, 4), 0.0, 2, notes.append)
    assert set(found) == {"inhabit_ray_1", "rllib_1"} and len(notes) == 1
    assert made == [
        ("console.bench.peers.fleet", 1), ("console.bench.peers.rllib", 1),
        ("console.bench.peers.fleet", 4), ("console.bench.peers.rllib", 4),
    ]  # fmt: skip
    figures = fleet_figures(found)
    assert figures["fleet_1_ratio"] == 1.0 and "fleet_4_ratio" not in figures
