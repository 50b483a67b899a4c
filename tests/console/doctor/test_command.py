"""`inhabit doctor`: services asked for their health, Ray for its reach, and the line to type."""

from pathlib import Path

import pytest

from console.app import parse
from console.doctor import command as doctor
from console.doctor.cluster import token
from console.doctor.finding import Finding
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.server import ServerConfig
from tests.support.console.doctors import found
from tests.support.style_cases import SMALL, Mocap


def test_services_that_answer_and_one_that_does_not(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    server = start(Discriminator(SMALL, Mocap(), 0), ServerConfig())
    try:
        words = ["--style", server.address, "--policy", server.address]
        code, lines = found(words, capsys)
    finally:
        server.drain()
    assert lines["style"]["verdict"] == "ok" and "serves" in lines["style"]["detail"]
    assert code == 1 and lines["policy"]["verdict"] == "bad"
    assert "serves no rpc.v1.Policy" in lines["policy"]["detail"]
    assert lines["next"]["detail"] == "mend first: policy"
    assert lines["motions"]["detail"].startswith("72 clips")
    assert all(set(line) == {"name", "verdict", "detail"} for line in lines.values())


def test_the_next_line_fits_what_was_found() -> None:
    plain, joined = parse(["doctor"]), parse(["doctor", "--address", "h:6379"])
    fine = Finding("python", "ok", "3.11")
    cluster = Finding("ray", "ok", "there", slots=17)
    assert doctor.following([fine], plain) == "inhabit train sit"
    assert doctor.following([fine, cluster], joined) == (
        "inhabit train sit --runner ray --actors 16 --scenes 1024 --address h:6379"
    )
    assert doctor.following([Finding("disk", "bad", "full")], plain) == "mend first: disk"


def test_the_token_is_named_and_never_shown(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "token"
    file.write_text("s3cret")
    for name in ("RAY_AUTH_MODE", "RAY_AUTH_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("RAY_AUTH_TOKEN_PATH", str(file))
    assert token() == f"token from {file}"
    monkeypatch.setenv("RAY_AUTH_TOKEN", "s3cret")
    assert token() == "token from RAY_AUTH_TOKEN"
    monkeypatch.setenv("RAY_AUTH_MODE", "disabled")
    assert "shows no token" in token()
