"""`inhabit objects`: import, list, check and show, and what a user gets wrong."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.commands import Meshes
from console.objects.command import options, seat_of
from tests.support.world.meshes import TRIANGLES, mesh, written
from world.errors import ChoiceError, ConfigError
from world.meshes import collection, importing, notes, store
from world.meshes.notes import Note


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_a_folder_is_imported_and_the_bad_file_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "chair"
    folder.mkdir()
    written(folder, ".obj")
    (folder / "broken.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    out = tmp_path / "out"
    words = ["objects", "import", str(folder), "--out", str(out), "--licence", "CC0", "--json"]
    assert main(words) == 1
    rows = {row["piece"]: row for row in json.loads(capsys.readouterr().out)}
    assert "no numbers" in rows["broken"]["refused"]
    found = rows["chair"]
    assert found["category"] == "chair"
    assert found["licence"] == "CC0"
    assert 4 <= found["hulls"] <= 16
    assert found["sit"][0]["height_m"] == pytest.approx(0.44, abs=0.03)
    assert abs(found["sit"][0]["facing_deg"]) <= 20
    assert [p.name for p in out.iterdir()] == [f"chair{store.SUFFIX}"]

    # the second time it comes from the cache, the same
    assert main([*words[:-1], "--debug"]) == 1
    assert "(1 from the cache), 1 refused" in capsys.readouterr().out
    (piece,) = collection.pieces([str(out)])
    assert piece.name == "chair"
    assert main(["objects", "check", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["sit"] == found["sit"]


def test_other_settings_make_another_piece(tmp_path: Path) -> None:
    path = written(tmp_path, ".obj")
    (job,) = importing.jobs([path], options(Meshes()))
    (other,) = importing.jobs([path], options(Meshes(sit="0,0,0.4,90")))
    keys = [importing._cached_outcome(j)[1] for j in (job, other)]
    assert keys[0] != keys[1]
    assert keys[0].split(":")[1] == keys[1].split(":")[1]


def test_a_file_that_is_gone_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, ".obj")
    (job,) = importing.jobs([path], options(Meshes()))
    refused = importing.run([replace(job, path=tmp_path / "gone.obj")], 1)
    assert "cannot read" in refused[0].refused


@pytest.mark.parametrize(
    ("bound", "value", "says"),
    [
        ("CPU_S", 1, "not done after 1 s of processor time; repair or decimate the mesh"),
        ("MEMORY_BYTES", 50 << 20, "needs more than 0.049 GiB; repair or decimate the mesh"),
    ],
)
def test_a_mesh_that_costs_too_much_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bound: str, value: int, says: str
) -> None:
    """The bounds themselves, on a mesh of 295,000 triangles."""
    fine = mesh()
    fine.merge_vertices()
    while len(fine.faces) < 200_000:
        fine = fine.subdivide()
    path = tmp_path / "chair.stl"
    fine.export(path)
    monkeypatch.setattr(importing, bound, value)
    (outcome,) = importing.run(importing.jobs([path], options(Meshes())), 1)
    assert outcome.document is None
    assert outcome.refused.endswith(says)


def test_a_catalogue_beside_the_files_gives_credit(tmp_path: Path) -> None:
    written(tmp_path, ".obj")
    (tmp_path / "catalog.csv").write_text("file,creator,licence\nchair,Ada,CC-BY 4.0\n")
    (job,) = importing.jobs([tmp_path], options(Meshes()))
    assert (job.options.credit, job.options.licence) == ("Ada", "CC-BY 4.0")


def test_a_readme_gives_the_licences_of_the_libraries_that_a_catalogue_names(
    tmp_path: Path,
) -> None:
    rows = ["file,library,creator,licence", "a,Alpha,Ada,", "b,Alpha-2,,", "c,Beta,Bo,", "d,,Di,"]
    rows.append("e,Alpha,Eve,GPL 3.0")
    (tmp_path / "catalog.csv").write_text("\n".join(rows))
    (tmp_path / "README.md").write_text(
        "# Meshes\nAlpha: not the line of licences\n"
        "- Licences: Alpha: CC-BY 3.0, (c) 2010 Alpha s.l.; Alpha-2: CC0, see the table. "
        "Gamma: none.\n"
    )
    found = notes.of_folder(tmp_path)
    assert found["a"] == Note("CC-BY 3.0", "Ada, (c) 2010 Alpha s.l.")
    assert found["b"] == Note("CC0", "")
    assert found["c"] == Note("", "Bo")
    assert found["d"] == Note("", "Di")
    assert found["e"].licence == "GPL 3.0"  # its own goes first
    assert notes.of_folder(tmp_path / "none") == {}
    (tmp_path / "README.md").unlink()
    assert notes.of_folder(tmp_path)["a"] == Note("", "Ada")


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["objects", "list", "test", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert len(rows) == 60
    assert {row["category"] for row in rows} >= {"sofa", "bed", "table"}
    bed = next(row for row in rows if row["category"] == "bed")
    assert set(bed["lie"][0]) == {"hip_m", "head_m"}


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["list", "nowhere"], 2, "nowhere: no such file or folder; choose train, test, all or"),
        (["import", "nowhere.obj"], 2, "inhabit: nowhere.obj: no such file or folder"),
        (["check", "nowhere.obj"], 2, "inhabit: nowhere.obj: no such file or folder"),
        (["import", "x.obj", "--up", "+z", "--front", "-z"], 2, "choose two different axes"),
        (["import", "x.obj", "--unit", "cm", "--height", "1"], 2, "choose one"),
        (["import", "x.obj", "--height", "-1"], 2, "height -1: must be 0.01 to 100"),
        (["import", "x.obj", "--category", "throne"], 2, "choose one of armchair"),
        (["import", "x.obj", "--sit", "1,2"], 2, "give X,Y,Z,YAW"),
        (["import"], 2, "PATH: missing: name the files or folders"),
        (["check"], 2, "PATH: missing: name the files or folders"),
        (["show"], 2, "--sheet FILE.png, --html FILE.html or both"),
        (["show", "--category", "throne", "--html", "x.html"], 2, "choose one of"),
    ],
)
def test_mistakes_are_one_line(
    words: list[str],
    code: int,
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("x.obj").touch()
    assert main(["objects", *words]) == code
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


def test_place_of() -> None:
    assert seat_of(None) is None
    assert seat_of("0.1,0,0.45,90") == (0.1, 0.0, 0.45, 90.0)
    for bad in ("a,b,c,d", "0,0,nan,0", "0,0,-1,0", "1,2,3,4,5"):
        with pytest.raises(ConfigError):
            seat_of(bad)
    with pytest.raises(ChoiceError):
        options(Meshes(category="throne"))


def test_what_was_decided_is_said_and_brackets_are_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A chair named a table, on a ground plane, in a file whose licence looks like markup."""
    half = 2.0
    a, b, c, d = (
        [x, y, 0.0] for x, y in ((-half, -half), (half, -half), (half, half), (-half, half))
    )
    corners = np.concatenate((TRIANGLES, np.array([[a, b, c], [a, c, d]])))
    path = written(tmp_path, ".stl", corners).rename(tmp_path / "desk [red]table.stl")
    out = tmp_path / "out"
    words = ["objects", "import", str(path), "--out", str(out), "--licence", "CC0 [bold] :smile:"]
    assert main(words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "CC0 [bold] :smile:" in said
    assert "a ground plane of 4.00 x 4.00 m is left out" in said
    assert "named a table, imported as a chair by its shape" in said
    assert main([*words, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["category"] == "chair" and len(row["notes"]) == 2
    assert row["size_m"][0] < 1.0


def test_a_refusal_names_the_file_as_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, ".stl", TRIANGLES / 0.0254).rename(tmp_path / "My [inch] Chair.stl")
    assert main(["objects", "import", str(path), "--out", str(tmp_path / "out")]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "refused: My [inch] Chair.stl: " in said and "give --unit in" in said


def test_a_piece_that_throws_the_ragdoll_off_is_imported_by_force_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A seat stated in the air, 0.2 m in front of the chair."""
    path = written(tmp_path, ".stl")
    out = tmp_path / "out"
    words = ["objects", "import", str(path), "--out", str(out), "--sit", "0.5,0,0.45,0"]
    assert main(words) == 1
    assert "slides or tips off this chair at every scale" in " ".join(
        capsys.readouterr().out.split()
    )
    assert not out.exists()
    assert main([*words, "--force"]) == 0
    assert "does not stay seated at scale 0.8, 1, 1.2" in capsys.readouterr().out
    assert len(list(out.iterdir())) == 1


def test_a_file_of_another_kind_is_named_in_its_refusal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("notes.txt", "README"):
        (tmp_path / name).write_text("hello")
    words = [str(tmp_path / name) for name in ("notes.txt", "README")]
    assert main(["objects", "import", *words, "--out", str(tmp_path / "out")]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "refused: notes.txt: unknown suffix '.txt'; meshes come as .obj, .glb" in said
    assert "refused: README: no suffix; meshes come as" in said


def test_the_piece_of_another_mesh_is_replaced_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A re-import, with other settings too, replaces its own piece without a flag."""
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
    out, piece = tmp_path / "out", tmp_path / "out" / f"chair{store.SUFFIX}"
    one = written(tmp_path / "one", ".obj")
    two = written(tmp_path / "two", ".obj", 0.9 * TRIANGLES)
    assert main(["objects", "import", str(one), "--out", str(out)]) == 0
    assert main(["objects", "import", str(one), "--out", str(out), "--credit", "A. Joiner"]) == 0
    assert store.read(piece).credit == "A. Joiner"
    capsys.readouterr()
    kept = piece.read_bytes()
    assert main(["objects", "import", str(two), "--out", str(out)]) == 2
    assert f"--out {out}: chair{store.SUFFIX} is no piece of this mesh" in capsys.readouterr().err
    assert piece.read_bytes() == kept
    assert main(["objects", "import", str(two), "--out", str(out), "--replace"]) == 0
    assert "1 piece in " in capsys.readouterr().out and piece.read_bytes() != kept
    piece.write_text("a user's own")
    assert main(["objects", "import", str(two), "--out", str(out)]) == 2
