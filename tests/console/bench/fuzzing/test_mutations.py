"""Random damage to files: fixed by its seed; damaged archives and digests can stay valid."""

import io
import json
import time
import zipfile
from pathlib import Path

import pytest

from console.bench.fuzzing.files import Sample, samples
from console.bench.fuzzing.mutations import mutated
from policy.checkpoints.format import digest_of


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Sample]:
    return samples(tmp_path_factory.mktemp("samples"))


def test_a_seed_gives_the_same_damage(
    files: dict[str, Sample], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At any time: archives hold the dates of their members."""
    for name, sample in files.items():
        monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(1e9))
        damaged = [mutated(sample, seed) for seed in range(8)]
        monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(1.5e9))
        assert damaged == [mutated(sample, seed) for seed in range(8)], name
        assert len(set(damaged)) > 4, name


def test_seven_archives_in_ten_stay_valid_with_another_member(files: dict[str, Sample]) -> None:
    valid = [c for c in (mutated(files["clip"], s) for s in range(60)) if whole(c)]
    with zipfile.ZipFile(io.BytesIO(files["clip"].content)) as archive:
        before = {name: archive.read(name) for name in archive.namelist()}
    assert 30 <= len(valid) <= 55
    for content in valid[:10]:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            after = {name: archive.read(name) for name in archive.namelist()}
        assert sum(after.get(name) != data for name, data in before.items()) <= 1


def whole(content: bytes) -> bool:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return archive.testzip() is None
    except Exception:
        return False


def test_manifests_of_other_values_have_a_digest_that_fits(files: dict[str, Sample]) -> None:
    signed = 0
    for seed in range(60):
        try:
            table = json.loads(mutated(files["manifest"], seed))
        except ValueError:
            continue
        if isinstance(table, dict) and table.get("sha256"):
            digest = table.pop("sha256")
            signed += digest == digest_of(table)
    assert signed >= 20


def test_an_empty_file_can_be_damaged() -> None:
    assert all(isinstance(mutated(Sample("a", b"", Path.read_bytes), s), bytes) for s in range(40))
