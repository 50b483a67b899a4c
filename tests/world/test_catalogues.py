"""Tables of files beside data: their names, columns, delimiters and damage."""

from pathlib import Path

import pytest

from world.catalogues import Row, of_folder, row_of


@pytest.mark.parametrize("name", ["INDEX.csv", "catalog.csv", "Catalogue.CSV", "licenses.csv"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_names_and_delimiters(tmp_path: Path, name: str, delimiter: str) -> None:
    rows = (("File", "Dataset", "License", "Author"), ("a.bvh", "ACCAD", "CC BY 3.0", "Ohio"))
    text = "\ufeff" + "\r\n".join(delimiter.join(row) for row in rows)
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert row_of(tmp_path / "a.bvh") == (Row("a.bvh", "CC BY 3.0", "ACCAD", "Ohio"), tmp_path)


def test_a_file_is_listed_by_path_by_name_or_by_stem(tmp_path: Path) -> None:
    (tmp_path / "s1" / "deep").mkdir(parents=True)
    (tmp_path / "INDEX.csv").write_text(
        "file,license\nwalk,by stem\nwalk.bvh,by name\ns1/walk.bvh,by path\n./s1\\run.amc,windows\n"
    )
    found = {
        "walk.npz": "by stem", "walk.bvh": "by name", "s1/walk.bvh": "by path",
        "s1/run.amc": "windows", "s1/deep/walk.bvh": "by name",
    }  # fmt: skip
    for name, licence in found.items():
        listed = row_of(tmp_path / name)
        assert listed is not None and listed[0].licence == licence, name
    assert row_of(tmp_path / "other.bvh") is None
    (tmp_path / "s1" / "deep" / "further").mkdir()
    assert row_of(tmp_path / "s1/deep/further/walk.bvh") is None  # three folders up


def test_the_nearest_catalogue_counts(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (tmp_path / "INDEX.csv").write_text("file,license\na,outer\nb,outer\n")
    (inner / "INDEX.csv").write_text("file,license\na,inner\n")
    assert [row_of(inner / name)[0].licence for name in ("a.bvh", "b.bvh")] == ["inner", "outer"]  # type: ignore[index]


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\x01\x02",
        b"no,columns\n1,2\n",
        b"file\n\n",
        b"\xff\xfe,x\n",
        b"file,licence\n,MIT",
    ],
)
def test_a_damaged_catalogue_lists_nothing(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "INDEX.csv").write_bytes(content)
    assert row_of(tmp_path / "a.bvh") is None
    assert all(not catalogue.rows for catalogue in of_folder(tmp_path))
