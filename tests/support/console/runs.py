"""What a command said, and what a run left."""

import pytest

SMALL = [
    "--scenes", "64", "--block", "32", "--world.pieces", "4", "--world.scales", "1",
    "--ppo.hidden", "32", "--style.hidden", "32", "--style.batch", "64", "--clone-passes", "1",
    "--clone-samples", "256", "--threads", "2", "--ppo.warmup-iterations", "1",
    "--style.normaliser-samples", "500", "--style.replay", "2000",
]  # fmt: skip


def said(capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that an error is."""
    text = capsys.readouterr().err.strip()
    assert text.startswith("inhabit: ") and "\n" not in text and "Traceback" not in text, text
    return text
