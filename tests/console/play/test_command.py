"""The player's command: where it listens, and what it refuses."""

from pathlib import Path

import pytest

from console.app import main
from console.play.server import start
from world.errors import ConfigError


def test_the_server_stays_on_this_machine() -> None:
    server = start("127.0.0.1:0")
    try:
        assert server.request_share_url() is None
        with pytest.raises(ConfigError, match=r"cannot listen on '127\.0\.0\.1"):
            start(f"127.0.0.1:{server.get_port()}")
    finally:
        server.stop()
    for wrong in ("nowhere", "127.0.0.1:x", "127.0.0.1:99999", ":80"):
        with pytest.raises(ConfigError, match="HOST:PORT"):
            start(wrong)
    for beyond in ("0.0.0.0:0", "[::]:0", "example.org:80"):
        with pytest.raises(ConfigError, match="--allow-insecure-remote"):
            start(beyond)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 2, "give a run, a checkpoint folder, a recording or a clip"),
        (["nowhere"], 2, "nowhere: no such run, checkpoint folder or file; the names"),
        (["a.txt"], 2, "a.txt: cannot be played; choose a run"),
        (["a.txt", "bad.npz"], 2, "'a.txt' is a file: play one file, or runs"),
        (["bad.msgpack"], 1, "bad.msgpack is damaged or not a recording"),
        (["bad.npz"], 1, "bad.npz"),
    ],
)
def test_the_command_refuses_in_a_line(
    words: list[str],
    code: int,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.txt", "bad.msgpack", "bad.npz"):
        Path(name).write_text("nothing of the kind")
    assert main(["play", *words, "--no-open"]) == code
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
