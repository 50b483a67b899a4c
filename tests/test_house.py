"""The rules of the house: direction of imports, size of files, one version, packages all listed."""

import ast
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from setuptools import find_packages

from tests.support.paths import ROOT

ROOMS = ["world", "rpc", "policy", "actors", "discriminator", "learner", "console"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SOURCES = sorted(p for room in ROOMS for p in (ROOT / room).rglob("*.py"))
WRITTEN = [p for p in SOURCES if (ROOT / "rpc/v1") not in p.parents]


def test_imports_run_downwards() -> None:
    linter = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run([linter, "--no-cache"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_files_stay_readable() -> None:
    tests = sorted((ROOT / "tests").rglob("*.py"))
    long = {
        str(path.relative_to(ROOT)): lines
        for path in [*WRITTEN, *tests]
        if (lines := len(path.read_text().splitlines())) > 450
    }
    assert not long, f"split these by noun: {long}"


def test_modules_open_with_a_sentence() -> None:
    mute = [
        str(path.relative_to(ROOT))
        for path in WRITTEN
        if (text := path.read_text()).strip() and not ast.get_docstring(ast.parse(text))
    ]
    assert not mute


def test_one_version_everywhere() -> None:
    version = PROJECT["project"]["version"]
    assert metadata.version("inhabit") == version
    newest = next(
        line for line in (ROOT / "CHANGELOG.md").read_text().splitlines() if line.startswith("## ")
    )
    assert newest.split()[1] == version


def test_every_package_is_installed() -> None:
    found = {
        ".".join(path.parent.relative_to(ROOT).parts)
        for room in ROOMS
        for path in (ROOT / room).rglob("*.py")
    }
    include = PROJECT["tool"]["setuptools"]["packages"]["find"]["include"]
    assert found == set(find_packages(str(ROOT), include=include))


def test_proto_is_no_package() -> None:
    """A top-level package called `proto` would hide proto-plus, which Ray's dashboard imports."""
    assert not list((ROOT / "proto").rglob("*.py"))
    import proto

    assert "site-packages" in str(proto.__file__)


@pytest.mark.parametrize("name", ["torch", "mujoco", "ray", "grpcio", "protobuf"])
def test_constraints_pin_what_is_installed(name: str) -> None:
    pins = dict(
        line.split("==")
        for line in (ROOT / "constraints.txt").read_text().splitlines()
        if "==" in line
    )
    assert metadata.version(name).split("+")[0] == pins[name]
