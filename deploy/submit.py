"""Submits a training to a Ray cluster, prints its log, and returns its exit status.

    python deploy/submit.py sit --run /shared/runs/sit --actors 60 --scenes 3840

It submits the repository of this file, from any folder. RAY_API_SERVER_ADDRESS is the address of
the cluster's dashboard (default http://127.0.0.1:8265); access needs RAY_AUTH_MODE=token and the
cluster's token. INHABIT_JOB_RESOURCES, such as {"learner": 1}, places the learner. Ctrl-C stops the
training, which writes a checkpoint.
"""

import asyncio
import json
import logging
import os
import shlex
import signal
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
INTERRUPTED = 130
ENDED_S = 30.0  # the exit status is set shortly after the last line of the log


def entrypoint(words: Sequence[str]) -> str:
    """Return the command of the job; SystemExit with 2 if the run would be lost with the job, with
    0 after --help."""
    if {"-h", "--help"} & set(words):
        print("usage: python deploy/submit.py TASK --run DIR [flags of inhabit train]\n")
        print((__doc__ or "").strip())
        raise SystemExit(0)
    flags = [word.partition("=")[0] for word in words]
    if "--run" not in flags and "--dry-run" not in flags:
        print(
            "submit: give --run and a folder that outlives the job, such as --run /shared/runs/sit",
            file=sys.stderr,
        )
        raise SystemExit(2)
    runner = [] if "--runner" in flags else ["--runner", "ray"]
    return shlex.join(["python", "-m", "console", "train", *words, *runner])


def main(words: Sequence[str]) -> int:
    """Submit the job, print its log, and return the training's exit status."""
    command = entrypoint(words)
    from ray.exceptions import RayError
    from ray.job_submission import JobStatus, JobSubmissionClient

    logging.getLogger("ray").setLevel(logging.ERROR)  # it logs every file that is left out
    address = os.environ.get("RAY_API_SERVER_ADDRESS", "http://127.0.0.1:8265")
    try:
        client = JobSubmissionClient(address)
        job = client.submit_job(
            entrypoint=command,
            runtime_env={
                "working_dir": str(ROOT),
                # Time from the stop request to the kill: an iteration and a checkpoint.
                "env_vars": {"RAY_JOB_STOP_WAIT_TIME_S": "300"},
            },
            entrypoint_resources=json.loads(os.environ.get("INHABIT_JOB_RESOURCES", "null")),
        )
    except (RayError, ConnectionError, RuntimeError, ValueError) as error:
        print(f"submit: {address}: {str(error).splitlines()[0]}", file=sys.stderr)
        return 1
    print(f"job {job} at {address}", flush=True)

    def stop(*_: object) -> None:
        # in a thread, because the handler interrupts calls that can hold the client's locks
        threading.Thread(target=client.stop_job, args=(job,), daemon=True).start()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)

    async def follow() -> None:
        async for part in client.tail_job_logs(job):
            print(part, end="", flush=True)

    asyncio.run(follow())
    deadline = time.monotonic() + ENDED_S
    while not (info := client.get_job_info(job)).status.is_terminal():
        if time.monotonic() > deadline:
            print(f"submit: the log of {job} ended before the job: check it later", file=sys.stderr)
            return 1
        time.sleep(0.5)
    if info.status == JobStatus.STOPPED:
        return INTERRUPTED
    if info.driver_exit_code is None:
        print(f"submit: {job} {info.status}: {info.message}", file=sys.stderr)
        return 1
    return info.driver_exit_code if info.driver_exit_code >= 0 else 128 - info.driver_exit_code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
