"""`inhabit serve` and `export` as their users meet them: they work, or say what is wrong."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import grpc
import numpy as np
import pytest
import torch

from console.app import main, parse
from console.serving.loading import served
from rpc.v1 import policy_pb2 as pb
from rpc.v1 import policy_pb2_grpc
from tests.support.console.runs import said
from tests.support.paths import ROOT
from tests.support.policy_cases import observation

PRETRAINED = ROOT / "pretrained" / "sit"


def test_a_published_policy_is_served_until_a_signal(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("s3cret\n")
    command = [sys.executable, "-m", "console", "serve", str(PRETRAINED), "--listen", "127.0.0.1:0"]
    process = subprocess.Popen(
        [*command, "--token-file", str(token), "--drain-s", "2"],
        stdout=subprocess.PIPE,
        text=True,
        env=dict(os.environ, OMP_NUM_THREADS="1", PYTHONPATH=str(ROOT)),
    )
    assert process.stdout is not None
    try:
        assert process.stdout.readline().startswith("sit: task sit, version ")
        address = process.stdout.readline().split()[-1]
        with grpc.insecure_channel(address) as channel:
            client = policy_pb2_grpc.PolicyStub(channel)
            shown = (("authorization", "Bearer s3cret"),)
            described = client.Describe(pb.DescribeRequest(), metadata=shown).policies[0]
            assert "SAMP" in described.training_data and "research" in described.licence
            state, goal = observation(0, 5)
            asked = pb.ActRequest(state=state, goal=goal)
            reply = client.Act(asked, metadata=shown)
            with pytest.raises(grpc.RpcError) as caught:
                client.Act(asked)
            assert caught.value.code() is grpc.StatusCode.UNAUTHENTICATED  # pyright: ignore
        policy = served("sit", PRETRAINED)
        rows = [np.frombuffer(part, "<f4").reshape(5, -1).copy() for part in (state, goal)]
        wanted = policy.policy(*(torch.from_numpy(part) for part in rows)).numpy()
        got = np.frombuffer(reply.action, "<f4").reshape(5, 28)
        np.testing.assert_allclose(got, wanted, atol=2e-4)
        assert reply.version == policy.version == described.version
        process.send_signal(signal.SIGTERM)
        assert process.wait(120) == 0
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


def test_an_unusable_policy_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def line(*words: str, code: int = 1) -> str:
        assert main(["serve", *words]) == code
        return said(capsys)

    pretrained = str(PRETRAINED)
    assert "none: no such run" in line(str(tmp_path / "none"), code=2)
    assert "holds no checkpoint" in line(str(tmp_path))
    assert "two policies have the name 'sit'" in line(pretrained, pretrained, code=2)
    assert "give at least one run" in line(code=2)
    text = line(pretrained, "--listen", "0.0.0.0:0", code=2)
    assert "open to other machines: give --tls-cert, --tls-key and --token-file" in text
    assert "--tls-cert and --tls-key: give both" in line(pretrained, "--tls-cert", ".", code=2)
    assert "not readable as PEM" in line(
        pretrained, "--tls-cert", __file__, "--tls-key", __file__, code=2
    )
    assert "must be HOST:PORT" in line(pretrained, "--listen", "nowhere", code=2)
    missing = str(tmp_path / "token")
    assert missing in line(pretrained, "--token-file", missing, code=2)
    damaged = tmp_path / "damaged"
    damaged.mkdir()
    (damaged / "manifest.json").write_text("{")
    assert "is damaged" in line(str(damaged))


def test_flags_set_what_the_service_takes_on() -> None:
    command = parse(["serve", "a=runs/a", "--batch.max-wait-s", "0.002", "--max-streams", "7"])
    assert command.service.batch.max_wait_s == 0.002 and command.service.max_streams == 7
    assert command.sources == ("a=runs/a",) and command.checkpoint == "best"


def test_export_writes_a_file_or_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("onnxruntime")
    out = tmp_path / "sit.onnx"
    assert main(["export", str(PRETRAINED), str(out)]) == 0
    assert (
        "ONNX Runtime deviates by at most" in capsys.readouterr().out
        and out.stat().st_size > 500_000
    )
    assert main(["export", str(tmp_path / "none"), str(out)]) == 2
    assert "no such run, checkpoint folder or file" in said(capsys)
    assert main(["export", str(PRETRAINED), str(tmp_path / "no" / "x.onnx")]) == 1
    assert "cannot write" in said(capsys)
