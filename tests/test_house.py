"""The rules of the house: direction of imports, size of files, one version, packages all listed."""

import ast
import subprocess
import sys
import tomllib
from collections import Counter
from importlib import metadata
from pathlib import Path

import pytest
from setuptools import find_packages

from tests.support.paths import ROOT

ROOMS = ["pretrained", "world", "rpc", "policy", "actors", "discriminator", "learner", "console"]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SOURCES = sorted(p for room in ROOMS for p in (ROOT / room).rglob("*.py"))
#: The client, a distribution of its own, with what it may import.
CLIENT = sorted((ROOT / "client").rglob("*.py"))
OF_CLIENT = {"inhabit_client", "grpc", "google", "numpy"}
#: Files at the top of a folder, and the share of modules that have a test of their name.
FILES_AT_MOST, TESTED_SHARE = 18, 0.9
GENERATED = {ROOT / "rpc/v1", ROOT / "client/inhabit_client/v1"}
WRITTEN = [p for p in [*SOURCES, *CLIENT] if not GENERATED & set(p.parents)]


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


def test_folders_stay_small() -> None:
    files = [*SOURCES, *CLIENT, *(ROOT / "tests").rglob("*.py")]
    counts = Counter(path.parent for path in files)
    full = {str(k.relative_to(ROOT)): n for k, n in counts.items() if n > FILES_AT_MOST}
    assert not full, f"more than {FILES_AT_MOST} files at the top of: {full}"


def defines(path: Path) -> bool:
    """Whether a module holds more than its docstring."""
    body = ast.parse(path.read_text()).body
    return any(not isinstance(node, ast.Expr) for node in body)


def own_test(module: Path) -> Path:
    """Where a module's own test is: `room/a/b.py` has `tests/room/a/test_b.py`; a package is called
    by its name."""
    folder = module.relative_to(ROOT).parent
    name = folder.name if module.name == "__init__.py" else module.stem.strip("_")
    return ROOT / "tests" / folder / f"test_{name}.py"


def test_nine_modules_in_ten_have_a_test_of_their_name() -> None:
    modules = [path for path in WRITTEN if defines(path)]
    without = [str(m.relative_to(ROOT)) for m in modules if not own_test(m).exists()]
    share = 1.0 - len(without) / len(modules)
    print(f"{share:.1%} of {len(modules)} modules; without: {' '.join(without)}")
    assert share >= TESTED_SHARE, f"{share:.1%}, without a test of their name: {without}"


def test_no_test_imports_another() -> None:
    guilty = {
        f"{path.relative_to(ROOT)}: {node.module}"
        for path in (ROOT / "tests").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").startswith("tests.")
        and not (node.module or "").startswith("tests.support")
    }
    assert not guilty, f"move what they share to tests/support: {guilty}"


def imported(path: Path) -> set[str]:
    """The top-level packages that a file imports, anywhere in it."""
    nodes = list(ast.walk(ast.parse(path.read_text())))
    plain = {a.name for n in nodes if isinstance(n, ast.Import) for a in n.names}
    others = {n.module or "" for n in nodes if isinstance(n, ast.ImportFrom) and not n.level}
    return {name.partition(".")[0] for name in plain | others}


def test_the_client_stands_alone() -> None:
    """It imports neither a package of ours nor what they need; none of ours imports it."""
    allowed = OF_CLIENT | set(sys.stdlib_module_names)
    guilty = {str(p.relative_to(ROOT)): n for p in CLIENT if (n := imported(p) - allowed)}
    assert CLIENT and not guilty
    assert not [path for path in SOURCES if "inhabit_client" in imported(path)]


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
    of_client = tomllib.loads((ROOT / "client" / "pyproject.toml").read_text())
    assert of_client["project"]["version"] == version
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
