"""The style service standing alone: protected like the policy service, and used by a training."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import pytest
import torch

from console.app import main, parse
from console.commands import Serve, Style, Train
from console.commands.training import StyleAddress
from console.run import assembly
from console.run.directory import RunDirectory
from console.run.experiment import Experiment, read_experiment
from console.training.style_service import attached
from discriminator.errors import StyleError
from rpc.errors import RefusedError
from tests.support import small_clips
from tests.support.paths import ROOT
from tests.support.rpc.certificates import certificates

SMALL = [
    "--scenes", "16", "--block", "16", "--horizon", "4", "--world.pieces", "2",
    "--world.scales", "1", "--ppo.hidden", "32", "16", "--style.hidden", "32", "16",
    "--style.batch", "32", "--style.penalty-batch", "16", "--style.normaliser-samples", "500",
    "--style.replay", "1000", "--clone-passes", "0", "--threads", "1",
]  # fmt: skip


def test_both_services_have_the_same_protection() -> None:
    protection = {
        "listen", "tls_cert", "tls_key", "tls_client_ca", "token_file", "allow_insecure_remote",
        "metrics", "health",
    }  # fmt: skip
    for kind in (Serve, Style):
        assert protection <= {field.name for field in fields(kind)}, kind


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    """A run of one iteration, whose style service goes on from its checkpoint."""
    clips = small_clips.write(tmp_path_factory.mktemp("clips"))
    path = tmp_path_factory.mktemp("runs") / "begun"
    words = ["train", "sit", "--run", str(path), "--iterations", "1", "--motions", str(clips)]
    assert main([*words, *SMALL]) == 0
    return RunDirectory(path)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Certificates by role, and a token."""
    folder = tmp_path_factory.mktemp("proof")
    token = folder / "token"
    token.write_text("s3cret\n")
    return certificates(folder) | {"token": str(token)}


@pytest.fixture(scope="module")
def served(run: RunDirectory, files: dict[str, str]) -> Iterator[str]:
    """The address of `inhabit style RUN` with mutual TLS and a token."""
    process = subprocess.Popen(
        [sys.executable, "-m", "console", "style", str(run.path), "--listen", "localhost:0",
         "--tls-cert", files["server.crt"], "--tls-key", files["server.key"],
         "--tls-client-ca", files["ca.crt"], "--token-file", files["token"],
         "--state", str(run.path / "journal")],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert process.stdout is not None and process.stderr is not None
    try:
        line = process.stdout.readline()
        assert line.endswith("version 1\n"), line
        yield line.split(" at ")[1].split(",")[0]
        process.send_signal(signal.SIGTERM)
        assert process.wait(120) == 0
        assert "have 10 s to end; Ctrl-C stops at once\n" in process.stderr.read()
        assert (run.path / "journal" / "state.safetensors").exists()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
        process.stderr.close()


def address(at: str, files: dict[str, str]) -> StyleAddress:
    """What the flags of a training give."""
    command = parse(
        ["train", "sit", "--runner", "ray", "--style-service.address", at,
         "--style-service.tls-ca", files["ca.crt"], "--style-service.tls-cert", files["client.crt"],
         "--style-service.tls-key", files["client.key"],
         "--style-service.token-file", files["token"]]
    )  # fmt: skip
    assert isinstance(command, Train)
    return command.style_service


def scored(style: object, experiment: Experiment) -> torch.Tensor:
    """Two rollouts scored, with a training between them."""
    rewards = []
    for batch in range(2):
        draw = torch.Generator().manual_seed(batch)
        steps, scenes = experiment.horizon, experiment.scenes
        found = style.score(  # type: ignore[attr-defined]
            batch,
            torch.randn(steps + 1, scenes, 114, generator=draw),
            torch.tensor([[1, 3]]),
            torch.randn(1, 114, generator=draw),
            torch.ones(steps, scenes, dtype=torch.bool),
        )
        assert found.version == batch
        rewards.append(found.reward)
        style.train(batch)  # type: ignore[attr-defined]
    return torch.stack(rewards)


def test_a_training_begins_there_as_with_its_own(
    served: str, run: RunDirectory, files: dict[str, str]
) -> None:
    experiment = read_experiment(run)
    wanted = scored(assembly.discriminator(experiment), experiment)
    for _ in range(2):  # whatever an earlier training left there
        with attached(address(served, files), experiment, print, run) as client:
            assert client.version == 0
            assert torch.equal(scored(client, experiment), wanted)
            assert client.version == 2


def test_a_service_of_another_experiment_is_refused(
    served: str, run: RunDirectory, files: dict[str, str]
) -> None:
    experiment = read_experiment(run)
    other = replace(experiment, style=replace(experiment.style, gradient_penalty=3.0))
    with (
        pytest.raises(StyleError, match=r"style\.gradient_penalty: 8\.0 -> 3\.0"),
        attached(address(served, files), other, print, run),
    ):
        pass


def test_another_token_is_refused(
    served: str, run: RunDirectory, files: dict[str, str], tmp_path: Path
) -> None:
    wrong = tmp_path / "token"
    wrong.write_text("guess")
    at = replace(address(served, files), token_file=wrong)
    with (
        pytest.raises(RefusedError, match="authorization: must be 'Bearer"),
        attached(at, read_experiment(run), print, run),
    ):
        pass


def test_an_address_without_the_ray_runner_is_a_mistake(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["train", "sit", "--run", str(tmp_path / "run"), "--iterations", "1", *SMALL]
    assert main([*words, "--style-service.address", "127.0.0.1:1"]) == 2
    assert "add --runner ray" in capsys.readouterr().err


@pytest.mark.parametrize("task", ["sit", "carry"])
def test_a_service_that_stands_alone_keeps_the_settings_of_one_stage(
    task: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The second stage has mocap of another seed, which the service was refused for hours later;
    carry's stages change no other setting of the discriminator."""
    words = ["train", task, "--recipe", "paper", "--run", str(tmp_path / "run"), "--runner", "ray"]
    assert main([*words, "--dry-run"]) == 0
    capsys.readouterr()
    assert main([*words, "--dry-run", "--style-service.address", "127.0.0.1:1"]) == 2
    assert "this recipe has other settings in each stage" in capsys.readouterr().err


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def started(run: RunDirectory, journal: Path, port: int) -> tuple[subprocess.Popen[str], str]:
    """`inhabit style RUN` with a journal, and the line that it begins with."""
    process = subprocess.Popen(
        [sys.executable, "-m", "console", "style", str(run.path), "--state", str(journal),
         "--listen", f"127.0.0.1:{port}"],
        stdout=subprocess.PIPE, text=True, env=dict(os.environ, PYTHONPATH=str(ROOT)),
    )  # fmt: skip
    assert process.stdout is not None
    return process, process.stdout.readline()


def test_a_killed_service_goes_on_from_its_journal_and_not_from_the_checkpoint(
    run: RunDirectory, tmp_path: Path
) -> None:
    """The run's checkpoint holds another replay: no bit of it may enter a training that goes on."""
    experiment = read_experiment(run)
    here = assembly.discriminator(experiment)
    journal, port = tmp_path / "journal", free_port()
    process, line = started(run, journal, port)
    try:
        assert "from checkpoint" in line and line.endswith("version 1\n"), line
        with attached(StyleAddress(address=f"127.0.0.1:{port}"), experiment, print, run) as client:
            for batch in range(6):
                if batch in (3, 5):
                    process.kill()  # SIGKILL
                    process.wait()
                    assert process.stdout is not None
                    process.stdout.close()
                    process, line = started(run, journal, port)
                    assert f"from its journal, version {batch}\n" in line, line
                draw = torch.Generator().manual_seed(batch)
                steps, scenes = experiment.horizon, experiment.scenes
                states = {
                    "rollout_states": torch.randn(steps + 1, scenes, 114, generator=draw),
                    "end_index": torch.tensor([[1, 3]]),
                    "end_states": torch.randn(1, 114, generator=draw),
                    "valid": torch.ones(steps, scenes, dtype=torch.bool),
                }
                assert torch.equal(client.score(batch, **states).reward,
                                   here.score(batch, **states).reward)  # fmt: skip
                assert client.train(batch) == here.train(batch)
            there, own = client.state_dict(), here.state_dict()
            assert there.keys() == own.keys()
            assert [name for name in own if not torch.equal(there[name], own[name])] == []
    finally:
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
