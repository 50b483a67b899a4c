"""A better checkpoint replaces what is served, in an open stream too; a bad one never does."""

import asyncio
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from policy.checkpoints.reload import Follower, Source
from policy.checkpoints.served import Served
from policy.config import PolicyServiceConfig
from policy.errors import CheckpointError
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import (
    expected,
    load,
    numbers,
    observation,
    running,
    save,
    stub,
)


def test_a_better_checkpoint_replaces_the_old_in_an_open_stream(tmp_path: Path) -> None:
    save(tmp_path / "000001", 1)
    best = tmp_path / "best"
    best.symlink_to("000001")

    def find_best() -> Path:
        if not best.exists():
            raise CheckpointError(f"{best} does not exist")
        return best.resolve()

    source = Source("sit", find_best, load)
    config = PolicyServiceConfig(poll_s=0.1)
    state, goal = observation(0)
    frames: list[int] = []
    more = threading.Semaphore(0)

    def sent() -> Iterator[pb.ControlRequest]:
        while more.acquire(timeout=60) and frames[-1] >= 0:
            seen = pb.Observation(state=state, goal=goal)
            yield pb.ControlRequest(sequence=frames[-1], observation=seen)

    def point_at(name: str) -> None:
        (tmp_path / "new").symlink_to(name)
        (tmp_path / "new").replace(best)

    def until(happened: object) -> None:
        deadline = time.monotonic() + 30
        while not happened():  # pyright: ignore
            assert time.monotonic() < deadline
            time.sleep(0.05)

    with running([source], config) as found, stub(found) as client:
        replies = client.Control(sent())

        def ask() -> pb.ControlReply:
            frames.append(len(frames))
            more.release()
            return next(replies)

        def description() -> pb.PolicyDescription:
            return client.Describe(pb.DescribeRequest()).policies[0]

        first = ask()
        assert first.version == description().version and first.version.startswith("1-")
        save(tmp_path / "000002", 2)
        point_at("000002")
        until(lambda: description().reloads == 1)
        second = ask()
        assert second.version == description().version and second.version.startswith("2-")
        np.testing.assert_allclose(
            numbers(second.action), expected(2, state, goal), rtol=2e-5, atol=2e-6
        )
        # corrupt, foreign, truncated, gone: the old one stays, and Describe says why
        save(tmp_path / "000003", 3)
        (tmp_path / "000003" / "policy.safetensors").write_bytes(b"garbage")
        point_at("000003")
        until(lambda: "damaged" in description().last_refusal)
        foreign = tmp_path / "000004"
        foreign.mkdir()
        (foreign / "manifest.json").write_text('{"format": 99}')
        point_at("000004")
        until(lambda: "format 99" in description().last_refusal)
        point_at("000009")
        until(lambda: "does not exist" in description().last_refusal)
        third = ask()
        assert third.version == second.version and third.action == second.action
        assert any("still serving 2-" in line for line in found.said)
        save(tmp_path / "000005", 5)
        point_at("000005")
        until(lambda: description().version.startswith("5-"))
        assert ask().version.startswith("5-") and description().last_refusal == ""
        frames.append(-1)
        more.release()


def test_a_disk_that_fails_for_a_moment_is_read_again_and_a_damaged_file_is_not(
    tmp_path: Path,
) -> None:
    save(tmp_path / "000001", 1)
    save(tmp_path / "000002", 2)
    current, faults, reads = [tmp_path / "000001"], [], []

    def read(path: Path) -> Served:
        reads.append(path)
        if faults:
            raise faults.pop()
        return load(path)

    follower = Follower(Source("sit", lambda: current[0], read))
    assert not asyncio.run(follower.poll())
    current[0] = tmp_path / "000002"
    try:
        raise CheckpointError("cannot read it") from OSError(5, "input/output error")
    except CheckpointError as error:
        faults[:] = [OSError(5, "input/output error"), error]
    for _ in range(2):
        assert not asyncio.run(follower.poll()) and follower.last_refusal
    assert asyncio.run(follower.poll()) and follower.served.version.startswith("2-")
    assert follower.last_refusal == ""
    # one that is damaged is refused once, and not read again
    save(tmp_path / "000003", 3)
    current[0] = tmp_path / "000003"
    faults[:] = [CheckpointError("it is damaged")]
    before = len(reads)
    assert not any(asyncio.run(follower.poll()) for _ in range(3))
    assert len(reads) == before + 1 and follower.last_refusal == "it is damaged"


def test_a_disk_that_is_back_with_the_same_checkpoint_is_no_refusal_any_more(
    tmp_path: Path,
) -> None:
    """Describe told the first outage for ever, and a second one was neither said nor counted."""
    save(tmp_path / "000001", 1)
    away: list[OSError] = []
    said: list[str] = []

    def find() -> Path:
        if away:
            raise away[0]
        return tmp_path / "000001"

    follower = Follower(Source("sit", find, load), said.append)
    for outage in (1, 2):
        away.append(OSError(5, "input/output error", str(tmp_path)))
        assert not asyncio.run(follower.poll())
        assert not asyncio.run(follower.poll())
        assert "input/output error" in follower.last_refusal and len(said) == outage
        away.clear()
        assert not asyncio.run(follower.poll())
        assert follower.last_refusal == "" and len(said) == outage


def test_reloads_go_on_when_nobody_reads_what_is_reported(tmp_path: Path) -> None:
    """As in `inhabit serve RUN 2>&1 | head`: the pipe of its lines is closed."""
    save(tmp_path / "000001", 1)
    now = [tmp_path / "000001"]

    def closed(line: str) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    follower = Follower(Source("sit", lambda: now[0], load), closed)
    first = follower.served.version
    now[0] = tmp_path / "none"
    assert not asyncio.run(follower.poll())
    assert "none" in follower.last_refusal and follower.served.version == first
    save(tmp_path / "000002", 2)
    now[0] = tmp_path / "000002"
    assert asyncio.run(follower.poll())
    assert follower.served.version != first and follower.reloads == 1
