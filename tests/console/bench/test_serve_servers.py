"""The bench's servers: an echo as large as a policy's answer, and processes kept on one core."""

import asyncio
import os
import subprocess
import sys

from console.bench import serve_servers
from rpc.v1 import policy_pb2 as pb


def test_the_echo_answers_with_as_many_bytes() -> None:
    reply = asyncio.run(serve_servers.Echo(28).Act(pb.ActRequest(), None))
    assert len(reply.action) == len(reply.target) == 4 * 28 and reply.version


def test_a_process_is_kept_on_the_servers_core() -> None:
    code = "import sys; print('here', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdin is not None
        process.stdout.readline()
        serve_servers.pin({process.pid})
        assert os.sched_getaffinity(process.pid) == {serve_servers.SERVER_CORE}
        process.stdin.close()
