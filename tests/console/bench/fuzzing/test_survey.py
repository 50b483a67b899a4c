"""Readers against random damage, a few of each format: read, or refused in one line."""

import tempfile
from pathlib import Path

import pytest

from console.bench.fuzzing import survey
from console.bench.fuzzing.mutations import mutated
from tests.support.paths import SHARED
from world.errors import ClipError

HOSTILE = SHARED / "cases" / "hostile" / "fuzz"
NAMES = survey.names_of()
#: Which format each of the collected files is damage to.
COLLECTED = {
    "bvh": "bvh", "glb": "glb", "gltf": "gltf", "msgpack": "recording", "npy": "poselib",
    "npz_amass": "amass", "npz_samp": "clip", "npz_train": "clip-trained", "piece": "piece",
    "pkl": "mimickit", "ply": "ply", "sh3f": "sh3f", "txt": "deepmimic", "metrics": "metrics",
    "ckpt": "manifest", "asf": "asf",
}  # fmt: skip


def test_there_are_21_formats_and_more() -> None:
    assert len(NAMES) >= 21


@pytest.mark.parametrize("name", NAMES)
def test_each_sample_is_read_undamaged(name: str) -> None:
    sample = survey._samples()[name]
    with tempfile.TemporaryDirectory() as folder:
        for other, content in sample.beside:
            Path(folder, other).write_bytes(content)
        path = Path(folder, sample.name)
        path.write_bytes(sample.content)
        assert survey.outcome(sample.read, path) == ("reads", "")


@pytest.mark.parametrize("name", NAMES)
def test_damage_is_refused_in_one_line(name: str) -> None:
    found = survey.damaged(name, 0, 12)
    assert found["faults"] == []
    assert found["counts"]["mutations"] == 12


def test_a_seed_is_always_the_same_damage() -> None:
    for sample in survey._samples().values():
        assert mutated(sample, 5) == mutated(sample, 5)
    sample = survey._samples()["bvh"]
    assert len({mutated(sample, seed) for seed in range(20)}) > 15


def test_what_is_no_refusal_is_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"

    def raising(error: Exception) -> None:
        raise error

    def outcome(error: Exception) -> str:
        return survey.outcome(lambda _: raising(error), path)[0]

    assert outcome(KeyError("x")) == "exceptions"
    assert outcome(ClipError(f"{path}: two\nlines")) == "exceptions"
    assert outcome(ClipError("something is wrong")) == "exceptions"
    assert outcome(ClipError(f"{path}: no motion")) == "refusals"


def test_the_bench_counts_in_children() -> None:
    done: list[float] = []
    figures, faults = survey.survey(40, 1, ("metrics", "map"), note=done.append)
    assert faults == [] and done == [20, 40]
    assert figures["mutations"] == 40 == figures["reads"] + figures["refusals"]
    assert figures["metrics/reads"] == 20, "a damaged line of metrics is left out alone"
    assert figures["exceptions"] == figures["crashes"] == 0


@pytest.mark.skipif(not HOSTILE.is_dir(), reason="no hostile files beside the project")
def test_the_collected_damages_are_refused_too(tmp_path: Path) -> None:
    tried = 0
    for file in sorted(HOSTILE.iterdir()):
        kind = file.name.split(".")[0].rpartition("_")[0]
        sample = survey._samples()[COLLECTED[kind]]
        folder = tmp_path / file.name
        folder.mkdir()
        for other, content in sample.beside:
            (folder / other).write_bytes(content)
        path = folder / sample.name
        path.write_bytes(file.read_bytes())
        assert survey.outcome(sample.read, path)[1] == "", file.name
        tried += 1
    assert tried >= 50
