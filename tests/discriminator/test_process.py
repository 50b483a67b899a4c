"""The style service in a process of its own: killed and back, or lost."""

import os
import signal
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from discriminator.client import StyleClient
from discriminator.errors import StyleError
from discriminator.journal import Journal
from discriminator.process import ServiceSpec, start_process
from discriminator.service import start
from rpc.channel import ChannelConfig
from rpc.errors import UnreachableError
from rpc.server import Server, ServerConfig
from tests.support.style_cases import SPEC, WIDTH, assert_equal_states, local, rollout


def test_after_a_kill_it_continues_exactly(tmp_path: Path) -> None:
    style, said = local(), []
    process = start_process(replace(SPEC, state=str(tmp_path / "style")), said.append)
    waiting: list[str] = []
    config = ChannelConfig(process.address, deadline_s=20, retry_s=60)
    client = StyleClient(config, waiting.append)
    try:
        for k in range(8):
            here = style.score(k, **rollout(k))
            if k == 2:  # before a rollout is scored: the client waits, then scores
                os.kill(process.pid, signal.SIGKILL)
            there = client.score(k, **rollout(k))
            assert torch.equal(there.reward, here.reward)
            assert there.version == k
            if k == 5:  # scored and not yet trained: the client sends the rollout again
                os.kill(process.pid, signal.SIGKILL)
            assert client.train(k) == style.train(k)
        assert_equal_states(client.state_dict(), style.state_dict())
        assert len(said) == 2
        assert sum("is away" in line for line in waiting) == 2
    finally:
        client.close()
        process.stop()


def test_a_crash_loop_ends_the_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("discriminator.process.MAX_DEATHS", 1)
    process = start_process(SPEC)
    client = StyleClient(ChannelConfig(process.address), lost=lambda: process.lost)
    try:
        os.kill(process.pid, signal.SIGKILL)
        with pytest.raises(UnreachableError, match=r"ended 1 times in a minute \(status -9\)"):
            client.score(0, **rollout(0))
    finally:
        client.close()
        process.stop()


def test_a_service_that_cannot_start_is_one_line(server: Server, tmp_path: Path) -> None:
    for spec, message in [
        (replace(SPEC, mocap="tests.support.style_cases:make_nothing"), "no clips in nowhere"),
        (replace(SPEC, mocap="tests.support.style_cases:none"), "has no attribute 'none'"),
        (replace(SPEC, server=ServerConfig(listen=server.address)), "Address already in use"),
    ]:
        with pytest.raises(StyleError, match=f"^style service: .*{message}"):
            start_process(spec)
    (tmp_path / "state.safetensors").write_bytes(b"torn")
    with pytest.raises(StyleError, match="remove it to start from scratch"):
        start(local(), ServerConfig(), journal=Journal(tmp_path))


def test_a_journal_without_its_replay_is_refused(tmp_path: Path) -> None:
    """Mapping a missing or torn file fills it up with zeros, on which a discriminator trained."""
    spec = replace(SPEC, state=str(tmp_path / "style"))
    process = start_process(spec)
    client = StyleClient(ChannelConfig(process.address, retry_s=20))
    try:
        client.score(0, **rollout(0))
        client.train(0)
    finally:
        client.close()
        process.stop()
    rows = tmp_path / "style" / "replay.f32"
    whole = rows.read_bytes()
    for left in (None, whole[:-4], whole + b"more"):
        rows.unlink(missing_ok=True)
        if left is not None:
            rows.write_bytes(left)
        there = 0 if left is None else len(left)
        with pytest.raises(StyleError, match=rf"replay.f32: {there} bytes, must be {len(whole)};"):
            start_process(spec)
    rows.write_bytes(whole)
    start_process(spec).stop()


def test_two_services_do_not_share_a_journal(tmp_path: Path) -> None:
    spec = replace(SPEC, state=str(tmp_path / "style"))
    first = start_process(spec)
    try:
        with pytest.raises(StyleError, match="another service uses it: name another --state"):
            start_process(spec)
    finally:
        first.stop()
    start_process(spec).stop()


def test_a_service_that_reads_too_long_is_said_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("discriminator.process.START_S", 0.5)
    spec = replace(SPEC, mocap="tests.support.style_cases:sleep")
    with pytest.raises(StyleError, match=r"still read its clips after 0\.5 s, and was ended"):
        start_process(spec)


def test_specs_survive_json() -> None:
    spec = replace(SPEC, object_mask=[False] * WIDTH, arguments={"clips": ["a"], "mirror": True})
    assert ServiceSpec.from_json(spec.to_json()) == spec
