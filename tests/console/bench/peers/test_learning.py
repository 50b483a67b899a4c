"""The comparison of returns with stand-ins: order, resumption, failures and refusals."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from console.app import main
from console.bench.peers import learning
from console.bench.peers.alternation import PeerError
from console.bench.peers.curves import Run
from console.bench.peers.learning import LEARNERS, Plan, equal, walk
from console.bench.peers.registry import NAMES, OURS, OURS_EQUAL
from console.commands import Bench
from console.run.directory import write_json
from console.run.experiment import PRESETS, check, differences, to_json
from world.errors import ChoiceError, ConfigError

#: A batch of 80 samples: curves of 1,000 samples have ten windows.
PRESET = replace(PRESETS["fast"], scenes=10, block=10)
SAMPLES = 1000


@pytest.fixture(autouse=True)
def stand_ins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """All libraries are installed, and their processes are stand-ins; the file of their notes."""
    log = tmp_path / "windows"
    monkeypatch.setenv("STAND_IN_TURNS", str(log))
    monkeypatch.setattr(learning, "module", lambda name: "tests.support.peers.learner")
    monkeypatch.setattr(
        learning, "installed", lambda paths, note, names, required: dict.fromkeys(names, "9.9")
    )
    return log


def measured(
    file: Path, seeds: int = 1, only: tuple[str, ...] = (), samples: int = SAMPLES
) -> tuple[dict[str, float], dict[str, Any], list[str]]:
    notes: list[str] = []

    def save(figures: dict[str, float], details: dict[str, Any]) -> None:
        write_json(file, {"figures": figures, **details})

    figures, details = learning.measure(
        PRESET, 1, samples, seeds, only, (), file, save, notes.append
    )
    return figures, details, notes


def names_of(details: dict[str, Any]) -> list[tuple[str, int]]:
    return [(run["name"], run["seed"]) for run in details["runs"]]


def test_all_are_trained_seed_by_seed(tmp_path: Path, stand_ins: Path) -> None:
    figures, details, notes = measured(tmp_path / "curves.json", seeds=2)
    assert names_of(details) == [(name, seed) for seed in range(2) for name in LEARNERS]
    assert [len(run["windows"]) for run in details["runs"]] == [10] * 12
    taken = [line.split() for line in stand_ins.read_text().splitlines()]
    assert [int(samples) for *_, samples in taken] == [*range(100, 1001, 100)] * 12
    assert {int(seed) for seed, *_ in taken[:60]} == {0} and {int(s[0]) for s in taken[60:]} == {1}
    # the stand-in's return is the thousands of samples and the seed: 0.2 and 1.2 at 200
    assert figures["skrl_at_200_return"] == pytest.approx(0.7)
    assert figures["rllib_at_1000_return_greatest"] == pytest.approx(2.0)
    assert (
        notes[1] == "rsl_rl, seed 0: return 0.20 at 200, 0.50 at 500, 1.00 at 1,000; 200 samples/s"
    )
    assert json.loads((tmp_path / "curves.json").read_text())["figures"] == figures


def test_a_training_that_was_stopped_is_repeated_alone(
    tmp_path: Path, stand_ins: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "curves.json"
    whole = learning.trained

    def stopped(name: str, *arguments: Any) -> Run:
        if name == "skrl":
            raise KeyboardInterrupt
        return whole(name, *arguments)

    monkeypatch.setattr(learning, "trained", stopped)
    with pytest.raises(KeyboardInterrupt):
        measured(file)
    before = json.loads(file.read_text())
    assert names_of(before) == [(OURS, 0), ("rsl_rl", 0)]
    monkeypatch.setattr(learning, "trained", whole)
    stand_ins.unlink()
    _, details, _ = measured(file)
    assert names_of(details) == [(name, 0) for name in LEARNERS]
    assert details["runs"][:2] == before["runs"]
    assert len(stand_ins.read_text().splitlines()) == 10 * (len(LEARNERS) - 2)
    stand_ins.unlink()
    measured(file)
    assert not stand_ins.exists(), "nothing is left to train"


def test_a_training_that_fails_is_left_out_and_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "curves.json"
    monkeypatch.setenv("STAND_IN_DIES", "1 300")
    _, details, notes = measured(file, 2, ("skrl",))
    assert names_of(details) == [("skrl", 0)] and details["seeds"] == 2
    assert notes[-1].startswith("skrl, seed 1: not measured: ")
    assert notes[-1].endswith("MemoryError: out of scenes")
    monkeypatch.delenv("STAND_IN_DIES")
    _, details, _ = measured(file, 2, ("skrl",))
    assert names_of(details) == [("skrl", 0), ("skrl", 1)]


def test_runs_of_other_calls_stay(tmp_path: Path) -> None:
    file = tmp_path / "curves.json"
    measured(file, 3, ("skrl",))
    figures, details, _ = measured(file, 1, (OURS,))
    assert names_of(details) == [(OURS, 0), ("skrl", 0), ("skrl", 1), ("skrl", 2)]
    assert details["seeds"] == 3 and "skrl_at_1000_return" in figures


def test_where_nothing_can_be_trained_there_are_no_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("STAND_IN_DIES", "0 100")
    with pytest.raises(PeerError, match="every training failed"):
        measured(tmp_path / "curves.json", 1, ("skrl",))
    assert not (tmp_path / "curves.json").exists()


def test_curves_of_other_settings_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "curves.json"
    measured(file, 1, ("skrl",))
    with pytest.raises(ConfigError, match=r"of other settings \(samples: 1000 -> 2000\)"):
        measured(file, 1, ("skrl",), samples=2000)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"runs": [{}], "plan": {}, "seeds": 1}'])
def test_a_file_of_something_else_is_not_overwritten(tmp_path: Path, text: str) -> None:
    file = tmp_path / "curves.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match="holds no curves of bench learning"):
        measured(file)
    assert file.read_text() == text


def test_unknown_names_are_refused_with_the_choices(tmp_path: Path) -> None:
    with pytest.raises(ChoiceError, match=r"--only 'skrll'.*inhabit, inhabit_equal, rllib"):
        measured(tmp_path / "curves.json", 1, ("skrll",))


def test_the_command_refuses_too_few_samples(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "learning", "--samples", "40959"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("--samples 40959: must be 40960 or above, ten iterations of 4096")


def test_flags_are_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []
    monkeypatch.setattr(learning, "measure", lambda *a: given.append(a))
    flags = {"samples": 70_000, "seeds": 2, "only": ("skrl",), "peer_python": ("skrl=x",)}
    command = Bench("learning", json=Path("curves.json"), **flags)
    learning.from_flags(command, PRESET, 2, print)
    assert given == [(PRESET, 2, 70_000, 2, ("skrl",), ("skrl=x",), Path("curves.json"), print)]


def test_ours_needs_no_peer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learning, "installed", None)
    _, details, _ = measured(tmp_path / "curves.json", 1, (OURS_EQUAL, OURS))
    assert names_of(details) == [(OURS, 0), (OURS_EQUAL, 0)]


def test_the_task_needs_no_clips() -> None:
    changed = sorted(differences(to_json(PRESET), to_json(check(walk(PRESET)))))
    assert changed == [
        "ppo.style_weight: 0.4 -> 0.0",
        "ppo.task_weight: 0.6 -> 1.0",
        "ppo.warmup_iterations: 15 -> 0",
        "world.episode_s: None -> 10.0",
        "world.hold_s: 1.5 -> 10.0",
        "world.initial.reference: 0.3 -> 0.0",
        "world.initial.standing_fraction: 0.3 -> 1.0",
        "world.task: sit -> walk",
    ]


def test_equal_rates_are_those_of_the_peers() -> None:
    plan = Plan(walk(PRESET), SAMPLES, 2)
    own, given = (plan.assignment(name, 5, "folder") for name in (OURS_EQUAL, "skrl"))
    assert own.experiment == equal(given.experiment) and own.counters == "folder"
    assert given.experiment.seed == own.experiment.seed == 5
    ppo = own.experiment.ppo
    assert ppo.actor_rate_bounds == (ppo.actor_rate, ppo.actor_rate)
    assert ppo.critic_rate == ppo.actor_rate == given.experiment.ppo.actor_rate


def test_each_has_its_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    found = [learning.module(name) for name in LEARNERS]
    ours = "console.bench.peers.ours"
    assert found == [ours, *(f"console.bench.peers.{name}" for name in NAMES), ours]


def test_missing_libraries_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        learning, "installed", lambda paths, note, names, required: {"rllib": "2.60.0"}
    )
    here = Path(sys.executable)
    found = learning.versions_of(LEARNERS, dict.fromkeys(NAMES, here), print)
    assert list(found) == [OURS, "rllib", OURS_EQUAL] and found["rllib"] == "2.60.0"
