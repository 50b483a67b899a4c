"""The style service killed in the middle of a batch, and the network to it cut: no bit changes."""

import os
import select
import signal
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from discriminator.client import StyleClient
from discriminator.process import ServiceSpec, StyleProcess, start_process
from discriminator.trainer import Discriminator
from rpc.channel import ChannelConfig
from tests.support.style_cases import SMALL, Mocap, assert_equal_states, rollout
from tests.support.tcp_proxy import Proxy

SPEC = ServiceSpec(mocap="tests.support.style_cases:make_mocap", style=SMALL)
CUT_S = 20.0
#: Bytes of a rollout of 64 steps and 64 scenes: 116 kB there, 16 kB of rewards back.
LARGE = {"steps": 64, "scenes": 64}


class Served:
    """A service in a process of its own with a journal, its client behind a proxy, and the same
    discriminator here, undisturbed."""

    def __init__(self, folder: Path, spec: ServiceSpec = SPEC) -> None:
        self.said: list[str] = []
        self.process: StyleProcess = start_process(replace(spec, state=str(folder / "style")))
        self.proxy = Proxy(self.process.address)
        config = ChannelConfig(self.proxy.address, retry_s=200)
        self.client = StyleClient(config, self.said.append)
        self.here = Discriminator(SMALL, Mocap(), 0)
        self.iterations = 0

    def kill(self) -> None:
        os.kill(self.process.pid, signal.SIGKILL)

    def iterate(self) -> None:
        """One rollout scored and trained on, there and here: the same numbers."""
        k, self.iterations = self.iterations, self.iterations + 1
        there = self.client.score(k, **rollout(k, **LARGE))
        here = self.here.score(k, **rollout(k, **LARGE))
        assert torch.equal(there.reward, here.reward) and there.version == here.version == k
        assert there.metrics == here.metrics
        assert self.client.train(k) == self.here.train(k)

    def same(self) -> None:
        """Network, optimiser, replay and counts: every rollout is in them once."""
        assert_equal_states(self.client.state_dict(), self.here.state_dict())
        status = self.client.status()
        assert (status.batches, status.transitions) == (self.here.batches, self.here.transitions)

    def close(self) -> None:
        self.client.close()
        self.proxy.close()
        self.process.stop()


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    held = Served(tmp_path_factory.mktemp("service"))
    yield held
    held.close()


@pytest.fixture
def served(shared: Served) -> Served:
    shared.said.clear()
    shared.iterate()
    return shared


def test_killed_while_a_batch_arrives_and_while_its_answer_leaves(served: Served) -> None:
    served.proxy.after("there", 60_000, served.kill)  # half of the states
    served.iterate()
    assert served.proxy.when is None, "it was killed"
    served.proxy.after("back", 8_000, served.kill)  # scored and in the replay, half answered
    served.iterate()
    assert served.proxy.when is None, "it was killed again"
    served.iterate()
    served.same()
    assert sum("is away" in line for line in served.said) == 2
    assert sum("is back" in line for line in served.said) == 2


def test_killed_in_the_middle_of_a_training_step(tmp_path: Path) -> None:
    once = str(tmp_path / "killed")
    spec = replace(SPEC, mocap="tests.support.style_cases:make_deadly", arguments={"once": once})
    served = Served(tmp_path, spec)
    try:
        for _ in range(4):
            served.iterate()
        assert Path(once).exists()
        served.same()
    finally:
        served.close()


def test_the_supervisor_has_no_threads_and_may_be_killed(tmp_path: Path) -> None:
    served = Served(tmp_path)
    try:
        served.iterate()
        supervisor, life = served.process.supervisor, served.process.pid
        assert len(list(Path(f"/proc/{supervisor}/task").iterdir())) == 1, "or a fork could lock up"
        served.kill()
        served.iterate()
        assert served.process.supervisor == supervisor and served.process.pid != life
        # A death of the supervisor alone has no effect; after one of its server, both are new.
        life = served.process.pid
        os.kill(supervisor, signal.SIGKILL)
        served.iterate()
        assert served.process.pid == life
        served.kill()
        served.iterate()
        assert supervisor != served.process.supervisor and gone(life)
        os.kill(served.process.supervisor, signal.SIGKILL)
        served.same()
        last = os.pidfd_open(served.process.pid)
    finally:
        served.close()
    assert gone(served.process.supervisor)
    # the server is killed with its group, and ends a moment later
    assert select.select([last], [], [], 60)[0] and gone(served.process.pid)
    os.close(last)


def gone(pid: int) -> bool:
    """Whether no process has that id; a zombie counts as none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


@pytest.mark.parametrize("silent", [True, False], ids=["packets vanish", "connections are reset"])
def test_the_network_is_cut_for_20_seconds(silent: bool, served: Served) -> None:
    """In the middle of a batch; connections of before never come back to life."""
    cut, mended = threading.Event(), threading.Event()

    def mend() -> None:
        mended.set()
        served.proxy.mend()

    def cut_now() -> None:
        cut.set()
        served.proxy.cut(silent)
        threading.Timer(CUT_S, mend).start()

    served.proxy.after("there", 60_000, cut_now)
    served.iterate()
    assert cut.is_set() and mended.is_set(), "it was cut, and went on when the network was back"
    served.iterate()
    served.same()
    assert [line.split(" is ")[1][:4] for line in served.said] == ["away", "back"]
