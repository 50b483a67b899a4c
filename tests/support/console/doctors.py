"""A doctor's findings by name."""

import json

import pytest

from console.app import main


def found(words: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, dict]]:
    code = main(["doctor", "--json", "--seconds", "0", *words])
    return code, {line["name"]: line for line in json.loads(capsys.readouterr().out)}
