"""The flags of the services and of what leaves a run, as they are typed."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands import Export, Serve, Style, Synthesize


def test_words_become_settings() -> None:
    words = ["serve", "a", "b", "--tls-cert", "c", "--batch.max-rows", "64", "--idle-s", "5"]
    found = parse(words)
    assert isinstance(found, Serve) and found.sources == ("a", "b")
    assert found.tls_cert == Path("c") and found.service.batch.max_rows == 64
    assert found.service.idle_s == 5.0 and found.service.batch.max_wait_s == 1e-3
    assert parse(["style", "run", "--state", "s"]) == Style(Path("run"), Path("s"))
    assert parse(["export", "run", "o.onnx"]) == Export(Path("run"), Path("o.onnx"))
    found = parse(["synthesize", "run", "--object", "o", "--out", "a.bvh", "b.npz", "--seed", "3"])
    assert isinstance(found, Synthesize) and found.seed == 3
    assert found.out == (Path("a.bvh"), Path("b.npz")) and found.perturb == "none"


def test_both_services_stay_on_this_machine_unless_told() -> None:
    for words in (["serve", "run"], ["style", "run"]):
        found = parse(words)
        assert found.listen.startswith("127.0.0.1:") and not found.allow_insecure_remote
        assert found.token_file is None


def test_disturbances_have_names() -> None:
    with pytest.raises(Exception, match="--perturb"):
        parse(["synthesize", "r", "--object", "o", "--out", "a.bvh", "--perturb", "wind"])
