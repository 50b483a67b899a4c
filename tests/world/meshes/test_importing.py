"""Many meshes: which there are, what they are called, and what is made once."""

from pathlib import Path

import pytest

from tests.support.world.meshes import written
from world.errors import PieceError
from world.meshes import importing
from world.meshes.build import ImportOptions


def test_names_are_tidy_and_distinct(tmp_path: Path) -> None:
    for name in ("b/My Chair (2).obj", "a/my-chair-2.stl", "a/notes.txt", "sofa/x.ply"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    found = importing.jobs([tmp_path], ImportOptions())
    assert [job.name for job in found] == ["my-chair-2", "my-chair-2-2", "x"]
    assert [job.options.named for job in found] == ["chair", "chair", "sofa"]
    assert [job.file_name for job in found] == ["my-chair-2.stl", "My Chair (2).obj", "x.ply"]


def test_a_path_without_meshes_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PieceError, match="no meshes; choose files of"):
        importing.jobs([tmp_path], ImportOptions())
    with pytest.raises(PieceError, match="no such file or folder"):
        importing.jobs([tmp_path / "nowhere"], ImportOptions())


def test_a_job_that_is_refused_starts_no_process(tmp_path: Path) -> None:
    told = []
    work = [
        importing.Job("a", "a.obj", ImportOptions(), refused="too large"),
        importing.Job("b", "b.obj", ImportOptions(), tmp_path / "gone.obj"),
    ]
    one, two = importing.run(work, 1, told.append)
    assert one.refused == "too large" and one.piece() is None and told == [one, two]
    assert two.refused.startswith("cannot read") and "No such file" in two.refused


def test_what_a_piece_is_made_from_decides_its_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert importing.cache_folder() == tmp_path / "cache/inhabit/objects"
    path = written(tmp_path, ".stl")
    jobs = [
        importing.Job("a", "a", told, path)
        for told in (ImportOptions(), ImportOptions(), ImportOptions(category="chair"))
    ]
    keys = [importing._cached_outcome(job)[1].split(":") for job in jobs]
    assert keys[0] == keys[1] != keys[2]
    assert keys[0][1] == keys[2][1], "the content is the same"


def test_a_number_of_a_repeated_name_is_no_other_file_s_name(tmp_path: Path) -> None:
    """Two pieces of one name would be one file: the second replaced the first."""
    for name in ("a/chair.obj", "b/chair-2.obj", "c/chair.obj", "d/chair.obj"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes(b"")
    found = importing.jobs([tmp_path], ImportOptions())
    assert [job.name for job in found] == ["chair", "chair-2", "chair-3", "chair-4"]
