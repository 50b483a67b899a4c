"""The package's own settings."""

import os
import subprocess
import sys


def test_fork_support_is_off_unless_the_environment_sets_it() -> None:
    code = "import os, rpc; print(os.environ['GRPC_ENABLE_FORK_SUPPORT'])"
    for given, found in (({}, "0"), ({"GRPC_ENABLE_FORK_SUPPORT": "1"}, "1")):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("GRPC_")} | given
        environment["PYTHONPATH"] = os.pathsep.join(sys.path)
        done = subprocess.run(
            [sys.executable, "-c", code], env=environment, capture_output=True, text=True
        )
        assert done.stdout.strip() == found
