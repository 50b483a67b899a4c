"""Child processes that read motions: limits by the size of the file, results in order."""

from pathlib import Path

from console.motions import child


def named(name: str) -> str:
    return name.upper()


def test_limits_grow_with_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_bytes(b"x" * 2_000_000)
    bounds = child.task(path, ("a",)).bounds
    assert (bounds.cpu_s, bounds.wall_s) == (70.0, 560.0)
    assert child.task(tmp_path / "missing.bvh", ("a",)).bounds.cpu_s == 10.0


def test_results_come_in_the_order_of_the_tasks(tmp_path: Path) -> None:
    tasks = [child.task(tmp_path / name, (name,)) for name in ("c", "a", "b")]
    assert [result.value for result in child.in_order(tasks, named, "naming")] == ["C", "A", "B"]
