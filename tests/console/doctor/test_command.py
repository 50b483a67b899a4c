"""`inhabit doctor`: services asked for their health, Ray for its reach, and the line to type."""

import socket
from pathlib import Path

import pytest

from actors.cluster import ClusterError
from console.app import parse
from console.doctor import command as doctor
from console.doctor.cluster import find_ray, token
from console.doctor.finding import Finding
from discriminator.service import start
from discriminator.trainer import Discriminator
from rpc.server import ServerConfig
from tests.support.console.doctors import found
from tests.support.style_cases import SMALL, Mocap
from world import surroundings


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
    assert lines["next"]["detail"] == "fix first: policy"
    assert lines["motions"]["detail"].startswith("72 clips")
    assert all(set(line) == {"name", "verdict", "detail"} for line in lines.values())


def test_the_next_line_fits_what_was_found() -> None:
    plain, joined = parse(["doctor"]), parse(["doctor", "--address", "h:6379"])
    fine = Finding("python", "ok", "3.11")
    cluster = Finding("ray", "ok", "there", slots=17)
    assert doctor.next_command([fine], plain) == "inhabit train sit"
    assert doctor.next_command([fine, cluster], joined) == (
        "inhabit train sit --runner ray --actors 16 --scenes 1024 --address h:6379"
    )
    assert doctor.next_command([Finding("disk", "bad", "full")], plain) == "fix first: disk"


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
    assert "no token is sent" in token()


def test_an_opengl_that_is_not_there_is_a_remark(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(surroundings, "missing_gl", surroundings.MissingGl("x", "no such"))
    monkeypatch.setattr("console.video.rendering.choose_gl", lambda: "egl")
    finding = doctor.check_rendering()
    assert finding.verdict == "mind"
    assert finding.detail == "MUJOCO_GL=x is not there (no such); `video` uses egl: unset MUJOCO_GL"
    monkeypatch.setattr("console.video.rendering.choose_gl", lambda: None)
    assert "MUJOCO_GL=x is not there (no such); neither egl nor" in doctor.check_rendering().detail


def test_a_stale_address_of_ray_is_named_by_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        address = f"127.0.0.1:{closed.getsockname()[1]}"
    monkeypatch.setenv("RAY_ADDRESS", address)
    with pytest.raises(ClusterError, match=rf"RAY_ADDRESS={address} .*unset RAY_ADDRESS"):
        find_ray()
    with pytest.raises(ClusterError, match=rf"answers at {address} .*leave --address out"):
        find_ray(address)
