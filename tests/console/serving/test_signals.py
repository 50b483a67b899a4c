"""What ends a command that waits for others: 130 after Ctrl-C, and 0 after SIGTERM where it then
drains."""

import os
import signal
import subprocess
import sys

import pytest

from tests.support import small_clips
from tests.support.paths import ROOT

SERVICES = {
    "serve": ["serve", str(ROOT / "pretrained" / "sit"), "--drain-s", "1"],
    "style": ["style", "RUN"],
}
PAGES = {
    "play": ["play", "CLIP", "--no-open"],
    "motions play": ["motions", "play", "CLIP", "--no-open"],
    "demo": ["demo", "--no-open"],
}


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A clip, and a run without a checkpoint, by the word that stands for it."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    run = tmp_path_factory.mktemp("run")
    environment = dict(os.environ, PYTHONPATH=str(ROOT))
    begin = ["train", "sit", "--run", str(run / "new"), "--motions", str(clips), "--iterations"]
    small = ["1", "--scenes", "16", "--block", "16", "--horizon", "4", "--world.pieces", "2"]
    quick = ["--world.scales", "1", "--clone-passes", "0", "--threads", "1"]
    subprocess.run(
        [sys.executable, "-m", "console", *begin, *small, *quick], check=True, env=environment
    )
    return {"RUN": str(run / "new"), "CLIP": str(next(clips.glob("*.npz")))}


def ended_by(number: signal.Signals, command: list[str], words: dict[str, str]) -> int:
    """The exit code of a command that gets a signal once it says where it listens."""
    command = [words.get(word, word) for word in command]
    process = subprocess.Popen(
        [sys.executable, "-m", "console", *command, "--listen", "127.0.0.1:0"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=dict(os.environ, OMP_NUM_THREADS="1", PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert process.stdout is not None and process.stderr is not None
    try:
        while " at " not in (line := process.stdout.readline()):
            assert line, process.stderr.read()
        process.send_signal(number)
        return process.wait(120)
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        process.stderr.close()


@pytest.mark.parametrize("name", [*SERVICES, *PAGES])
def test_ctrl_c_ends_with_130(name: str, words: dict[str, str]) -> None:
    assert ended_by(signal.SIGINT, (SERVICES | PAGES)[name], words) == 130


@pytest.mark.parametrize("name", SERVICES)
def test_sigterm_drains_a_service_and_ends_with_0(name: str, words: dict[str, str]) -> None:
    assert ended_by(signal.SIGTERM, SERVICES[name], words) == 0
