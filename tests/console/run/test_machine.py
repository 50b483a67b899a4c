"""What is said of this machine, against what the system says."""

import os
import subprocess
import sys

from console.run import machine


def test_this_process_and_its_children_are_the_process_tree() -> None:
    code = "import sys; sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE) as child:
        assert {os.getpid(), child.pid} <= machine.process_tree()
        assert os.getppid() not in machine.process_tree()
        assert child.stdin is not None
        child.stdin.close()
    assert child.pid not in machine.process_tree()


def test_memory_is_in_gigabytes() -> None:
    here = machine.resident_gb()
    assert 0.01 < here < machine.memory_gb() and here <= machine.process_tree_gb()
    assert machine.resident_gb(2**30) == 0.0


def test_cores_are_those_that_may_be_used() -> None:
    assert machine.cores() == len(os.sched_getaffinity(0))
    assert machine.describe()["cores"] == machine.cores()


def test_versions_are_the_installed_ones() -> None:
    import numpy

    found = machine.versions()
    assert found["numpy"] == numpy.__version__ and set(found) == set(machine.PACKAGES)
