"""Files and folders appear whole or not at all, under names that nobody can foresee."""

import os
import stat
from pathlib import Path

import pytest

from world import partial_files
from world.partial_files import link, remove_leftovers, replacing, replacing_folder


def test_a_file_appears_whole_with_the_permissions_of_a_new_one(tmp_path: Path) -> None:
    path, plain = tmp_path / "a.txt", tmp_path / "plain"
    plain.touch()
    with replacing(path) as partial:
        assert partial.parent == tmp_path and partial.suffix == ".txt"
        partial.write_text("half")
        assert not path.exists()
    assert path.read_text() == "half"
    assert stat.S_IMODE(path.stat().st_mode) == stat.S_IMODE(plain.stat().st_mode)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "plain"]


def test_an_error_leaves_what_was_there(tmp_path: Path) -> None:
    path, folder = tmp_path / "a", tmp_path / "f"
    path.write_text("old")
    folder.mkdir()
    (folder / "old").touch()
    with pytest.raises(KeyboardInterrupt), replacing(path) as partial:
        partial.write_text("new")
        raise KeyboardInterrupt
    with pytest.raises(ValueError, match="no"), replacing_folder(folder) as partial:
        (partial / "new").touch()
        raise ValueError("no")
    assert path.read_text() == "old" and [p.name for p in folder.iterdir()] == ["old"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "f"]


def test_a_folder_takes_the_place_of_another_and_a_link_of_another(tmp_path: Path) -> None:
    for name in ("one", "two"):
        with replacing_folder(tmp_path / "f") as partial:
            (partial / name).touch()
        link(tmp_path / "latest", name)
    assert [p.name for p in (tmp_path / "f").iterdir()] == ["two"]
    assert os.readlink(tmp_path / "latest") == "two"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["f", "latest"]


def test_a_folder_that_cannot_be_put_there_leaves_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    (folder / "old").touch()
    rename = Path.rename

    def fails(self: Path, target: Path) -> Path:
        if target == folder and partial_files.SUFFIX in self.name:
            raise OSError("full")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(OSError, match="full"), replacing_folder(folder) as partial:
        (partial / "new").touch()
    assert [p.name for p in folder.iterdir()] == ["old"]
    assert [p.name for p in tmp_path.iterdir()] == ["f"]


def test_names_differ_each_time_and_a_link_laid_there_is_not_followed(tmp_path: Path) -> None:
    names = set()
    for _ in range(8):
        with replacing(tmp_path / "a") as partial:
            names.add(partial.name)
            assert not partial.is_symlink()
            assert stat.S_IMODE(partial.stat().st_mode) == 0o600, "nobody else writes to it"
    assert len(names) == 8
    other = tmp_path / "other"
    other.write_text("mine")
    (tmp_path / "a").unlink()
    (tmp_path / "a").symlink_to(other)
    with replacing(tmp_path / "a") as partial:
        partial.write_text("theirs")
    assert other.read_text() == "mine" and not (tmp_path / "a").is_symlink()


def test_leftovers_of_a_killed_process_are_removed_and_nothing_else(tmp_path: Path) -> None:
    with pytest.raises(SystemExit), replacing_folder(tmp_path / "f") as folder:
        with replacing(tmp_path / "a.npz") as file:
            kept = file.with_name(file.name.replace("a.npz", "b.npz"))
            kept.touch()
        raise SystemExit
    folder.mkdir()
    (folder / "inner").touch()
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "mine").touch()
    (tmp_path / f".x{partial_files.SUFFIX}").symlink_to(outside)
    remove_leftovers(tmp_path)
    remove_leftovers(tmp_path / "nowhere")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.npz", "outside"]
    assert (outside / "mine").exists()
