"""The journal: what was saved last comes back, and a torn file is said."""

import hashlib
from pathlib import Path

import pytest
import torch

from discriminator.errors import StyleError
from discriminator.journal import Journal


def test_the_last_state_comes_back(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "style")
    assert journal.load() is None
    journal.save({"version": torch.tensor(1), "w": torch.ones(2, 3)})
    journal.save({"version": torch.tensor(2), "w": torch.zeros(2, 3)})
    found = Journal(tmp_path / "style").load()
    assert found is not None
    assert int(found["version"]) == 2 and torch.equal(found["w"], torch.zeros(2, 3))
    assert [p.name for p in (tmp_path / "style").iterdir()] == ["state.safetensors"]


def test_a_write_that_did_not_end_leaves_the_state_before_it(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    journal.save({"version": torch.tensor(1)})
    left = tmp_path / ".state.safetensors.x.partial.safetensors"
    left.write_bytes(b"half")
    found = Journal(tmp_path).load()
    assert not left.exists()
    assert found is not None and int(found["version"]) == 1


def test_a_damaged_state_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "state.safetensors").write_bytes(b"torn")
    with pytest.raises(StyleError, match="remove it to start from scratch") as caught:
        Journal(tmp_path).load()
    assert "\n" not in str(caught.value)


def test_a_journal_keeps_the_digest_of_a_training_and_reads_the_id_of_an_older_one(
    tmp_path: Path,
) -> None:
    journal, digest = Journal(tmp_path), hashlib.sha256(b"secret").hexdigest()
    assert journal.training() == ""
    journal.set_training(digest)
    assert journal.training() == digest
    (tmp_path / "training").write_text("secret\n")
    assert journal.training() == digest
    journal.set_training("")
    assert journal.training() == ""
