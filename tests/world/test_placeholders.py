"""What stands in place of data is called by its name."""

import os
import tracemalloc
from pathlib import Path

import pytest

from world.errors import ClipError
from world.motions import npz
from world.placeholders import placeholder, pointer, read_bounded

LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n"


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.npz", LFS, "a Git LFS pointer, not the data: fetch it with 'git lfs pull'"),
        ("a.bvh", LFS.replace(b"\n", b"\r\n"), "a Git LFS pointer"),
        ("a.npz", b"/annex/objects/SHA256E-s1--0.npz\n", "git annex get"),
        ("a.npz", b"../../.git/annex/objects/a/b", "git annex get"),
        ("a.bvh", b"<!DOCTYPE html>\n<html><body>Sign in</body></html>", "a web page"),
        ("a.bvh", b"\n\n  <html lang='en'>", "a web page"),
        ("a.npz", b"\xef\xbb\xbf<!doctype HTML>", "a web page"),
        ("a.npz", b"<?xml version='1.0'?><!DOCTYPE html><html>", "a web page"),
        ("a.npz", b"<?xml version='1.0'?><Error><Code>AccessDenied</Code></Error>", "XML document"),
        ("a.bvh", b"PK\x03\x04rest", "a ZIP archive: unpack it first"),
        ("a.bvh", b"\x1f\x8b\x08", "a gzip archive"),
        ("a.pkl", bytes(64), "nothing but zeros"),
    ],
)
def test_what_a_file_is(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    assert said in (placeholder(tmp_path / name) or "")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.npz", b"PK\x03\x04rest"), ("a.pt", b"PK\x03\x04rest"), ("a.bvh", b"HIERARCHY\n"),
        ("a.pkl", b"\x80\x04}"), ("a.json", b'{"a": "<html>"}'), ("a.amc", b"#!OML:ASF <html>"),
        ("a.npy", b"\x93NUMPY"), ("a.txt", b""),
    ],
)  # fmt: skip
def test_data_is_none(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    assert placeholder(tmp_path / name) is None


def test_what_is_no_file_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.npz")  # opening it waits for a writer
    (tmp_path / "endless.bvh").symlink_to("/dev/zero")
    assert placeholder(tmp_path / "pipe.npz") == "a pipe or a device, not a file"
    assert placeholder(tmp_path / "endless.bvh") == "a pipe or a device, not a file"
    assert placeholder(tmp_path) == "a folder, not a file"
    with pytest.raises(FileNotFoundError):
        placeholder(tmp_path / "absent.npz")


@pytest.mark.parametrize("content", [LFS, b"<html>Sign in</html>"])
def test_bounded_reads_and_archives_name_what_lies_in_place_of_data(
    tmp_path: Path, content: bytes
) -> None:
    """So do all readers of recordings, pieces, manifests, configurations, clips and caches."""
    path = tmp_path / "a.npz"
    path.write_bytes(content)
    with pytest.raises(OSError, match=r"not the data"):
        read_bounded(path, 1000)
    with pytest.raises(ClipError, match=r"a\.npz: a .*, not the data"), npz.opened(path):
        pass
    assert "not the data" in (pointer(path) or "")
    path.write_bytes(b"PK\x03\x04")
    assert pointer(path) is None and read_bounded(path, 1000) == b"PK\x03\x04"
    assert pointer(tmp_path) is None and pointer(tmp_path / "absent") is None


def test_content_is_bounded_and_a_files(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b"12345")
    assert read_bounded(tmp_path / "a.json", 5) == b"12345"
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe.json")
    for name, most, said in (
        ("a.json", 4, "more than 0 MB"),
        ("endless.json", 9, "a pipe or a device, not a file"),
        ("pipe.json", 9, "a pipe or a device, not a file"),
        (".", 9, "a folder, not a file"),
        ("absent.json", 9, "No such file"),
    ):
        with pytest.raises(OSError, match=said):
            read_bounded(tmp_path / name, most)


def test_a_short_file_takes_little_memory_whatever_the_limit(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_bytes(b"12345")
    tracemalloc.start()
    try:
        assert read_bounded(tmp_path / "a.json", 1 << 31) == b"12345"
        _, peak_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak_bytes < 1 << 20
