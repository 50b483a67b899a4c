"""Credits and terms that stand beside mesh files."""

from pathlib import Path

from world.meshes.notes import Note, of_file, of_folder


def test_a_library_s_terms_come_from_the_readme(tmp_path: Path) -> None:
    (tmp_path / "catalog.csv").write_text(
        "file,library,creator,licence\n"
        "chair,Big-Lib,Ada,\nsofa,Big-Lib,,CC0\nbed,,Bob,CC BY 4.0\nlamp,Lib,,\n"
    )
    (tmp_path / "README.md").write_text(
        "# Meshes\n- **Licences**: Big-Lib: Free Art License 1.3, (c) eTeks; "
        "Lib: CC BY 3.0. More.\n"
    )
    assert of_folder(tmp_path) == {
        "chair": Note("Free Art License 1.3", "Ada, (c) eTeks"),
        "sofa": Note("CC0", "(c) eTeks"),
        "bed": Note("CC BY 4.0", "Bob"),
        "lamp": Note("CC BY 3.0", ""),
    }


def test_a_name_that_ends_a_longer_one_has_its_own_terms(tmp_path: Path) -> None:
    (tmp_path / "catalog.csv").write_text("file,library\na,Lib\nb,Big Lib\nc,Wee Lib\n")
    readme = tmp_path / "README.md"
    readme.write_text("Licences: Big Lib: CC BY 3.0, (c) Big; Lib: CC0, (c) Small. Wee Lib: GPL\n")
    big, small = Note("CC BY 3.0", "(c) Big"), Note("CC0", "(c) Small")
    assert of_folder(tmp_path) == {"a": small, "b": big, "c": Note("GPL", "")}
    # also where the shorter name has no terms of its own
    readme.write_text("Licences: Big Lib: CC BY 3.0, (c) Big\n")
    assert of_folder(tmp_path) == {"a": Note(), "b": big, "c": Note()}


def test_without_notes_nothing_is_printed(tmp_path: Path) -> None:
    assert of_folder(tmp_path) == {}
    (tmp_path / "catalog.csv").write_bytes(b"\xff\xfe,licence\nfile,x\n")
    assert of_folder(tmp_path) == {}
    (tmp_path / "catalog.csv").write_text("file,library\na,Unknown\n,Unknown\n")
    assert of_folder(tmp_path) == {"a": Note()}


def test_the_nearest_catalogue_that_lists_a_file_counts(tmp_path: Path) -> None:
    """A library has one catalogue and a folder for each class."""
    (tmp_path / "catalog.csv").write_text("file,licence\na,CC0\nb,CC BY 4.0\nc,MIT\n")
    inner = tmp_path / "chair" / "old"
    inner.mkdir(parents=True)
    (inner / "catalog.csv").write_text("file,licence\nb,GPL-3.0\n")
    assert of_file(tmp_path / "a.obj").licence == "CC0"
    assert of_file(tmp_path / "chair" / "b.obj").licence == "CC BY 4.0"
    assert of_file(inner / "b.obj").licence == "GPL-3.0"
    assert of_file(inner / "c.obj").licence == "MIT"  # not in the nearest one
    assert of_file(inner / "d.obj") == Note()
    deep = inner / "more"
    deep.mkdir()
    assert of_file(deep / "a.obj") == Note()  # three folders above
