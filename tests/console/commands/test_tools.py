"""The flags of what looks at this machine, as they are typed."""

from pathlib import Path

import pytest

from console.app import parse
from console.commands import Bench, Doctor


def test_words_become_settings() -> None:
    found = parse(["bench", "train", "--preset", "paper", "--scenes", "128", "--seconds", "3"])
    assert found == Bench("train", "paper", 128, seconds=3.0)
    assert parse(["doctor", "--style", "h:1", "--tls-ca", "ca"]) == Doctor(
        style="h:1", tls_ca=Path("ca")
    )


@pytest.mark.parametrize("wrong", [["bench", "everything"], ["bench"], ["bench", "train", "--x"]])
def test_what_is_no_bench_is_refused(wrong: list[str]) -> None:
    with pytest.raises(Exception) as caught:
        parse(wrong)
    assert "\n" not in str(caught.value)
