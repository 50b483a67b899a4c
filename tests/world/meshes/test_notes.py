"""Credits and terms that stand beside mesh files."""

from pathlib import Path

from world.meshes.notes import Note, of_folder


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


def test_without_notes_nothing_is_said(tmp_path: Path) -> None:
    assert of_folder(tmp_path) == {}
    (tmp_path / "catalog.csv").write_bytes(b"file,licence\n\xff\xfe,x\n")
    assert of_folder(tmp_path) == {}
    (tmp_path / "catalog.csv").write_text("file,library\na,Unknown\n,Unknown\n")
    assert of_folder(tmp_path) == {"a": Note()}
