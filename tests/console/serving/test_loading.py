"""Which policy is served, under which name."""

from pathlib import Path

import pytest

from console.serving.loading import checkpoint_of
from console.serving.policy import sources_of
from tests.support.paths import ROOT
from world.errors import ConfigError

PRETRAINED = ROOT / "pretrained" / "sit"


def test_policies_have_names(tmp_path: Path) -> None:
    found = sources_of([str(PRETRAINED), f"other={PRETRAINED}"], "best")
    assert [source.name for source in found] == ["sit", "other"]
    assert found[1].load(found[1].find()).check().name == "other"
    with pytest.raises(ConfigError, match="must be RUN or NAME=RUN"):
        sources_of([f"={PRETRAINED}"], "best")


def test_the_best_checkpoint_of_a_run_is_preferred(tmp_path: Path) -> None:
    checkpoints = tmp_path / "checkpoints"
    for name in ("000001", "000002"):
        (checkpoints / name).mkdir(parents=True)
        (checkpoints / name / "manifest.json").write_text("{}")
    (checkpoints / "latest").symlink_to("000002")
    assert checkpoint_of(tmp_path, "best").name == "000002"
    (checkpoints / "best").symlink_to("000001")
    assert checkpoint_of(tmp_path, "best").name == "000001"
    assert checkpoint_of(tmp_path, "latest").name == "000002"
