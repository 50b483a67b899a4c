"""Files that stand in place of data: pointers of version control, web pages, archives."""

import errno
import os
import stat
from pathlib import Path

_HEAD_BYTES = 1024
#: First bytes of a file, what it is, and the remedy.
_POINTERS = (
    (b"version https://git-lfs", "a Git LFS pointer, not the data", "fetch it with 'git lfs pull'"),
    (b"/annex/objects/", "a git-annex pointer, not the data", "fetch it with 'git annex get'"),
)
_ARCHIVES = (
    (b"\x1f\x8b", "a gzip archive", "unpack it first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "unpack it first"),
    (b"rar!\x1a\x07", "a RAR archive", "unpack it first"),
)
_PAGES = (b"<!doctype html", b"<html", b"<head", b"<body", b"<script")
_ZIP = b"pk\x03\x04"
#: Suffixes of files that are ZIP archives themselves.
ZIPPED = (".npz", ".pt")


def read_bounded(path: Path, most: int) -> bytes:
    """The bytes of a file of at most `most` bytes.

    Raises OSError for a folder, a pipe and a device, which may have no end or wait for a writer,
    for a longer file, and for a pointer or a web page in place of data.
    """
    what = _irregular(path)
    if what:
        raise OSError(errno.EINVAL, what, str(path))
    with path.open("rb") as file:
        # a read of `most` would reserve that much memory for any file
        size = os.fstat(file.fileno()).st_size
        data = file.read(min(size, most) + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"more than {most / 1e6:.0f} MB", str(path))
    if what := _elsewhere(_start(data[:_HEAD_BYTES])):
        raise OSError(errno.EINVAL, what, str(path))
    return data


def pointer(path: Path) -> str | None:
    """What a file is that only says where the data are, and the remedy; None for any other, also
    for one that cannot be read."""
    try:
        if _irregular(path):
            return None
        with path.open("rb") as file:
            return _elsewhere(_start(file.read(_HEAD_BYTES)))
    except OSError:
        return None


def _start(head: bytes) -> bytes:
    """The first bytes of a file as they are compared."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip().lower()


def _elsewhere(start: bytes) -> str | None:
    """What a file that begins so is in place of data that lie elsewhere; None where it may be
    data."""
    for first, what, remedy in _POINTERS:
        if start.startswith(first):
            return f"{what}: {remedy}"
    if start.startswith(b".") and b".git/annex/objects/" in start.splitlines()[0]:
        _, what, remedy = _POINTERS[1]
        return f"{what}: {remedy}"
    # a page may begin with a declaration or comments of XML
    if start.startswith(_PAGES) or (start.startswith(b"<") and b"<html" in start):
        return "a web page, not the data: download the file itself (the page may ask to log in)"
    return None


def _irregular(path: Path) -> str | None:
    """What a path is in place of a file, in words; None for a file. Raises OSError for none."""
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        return "a folder, not a file"
    return None if stat.S_ISREG(mode) else "a pipe or a device, not a file"


def placeholder(path: Path) -> str | None:
    """What a file is in place of data and the remedy, in words; None where it may be data.

    A pipe or a device is not opened: it may have no end, or wait for a writer. Raises OSError where
    the file cannot be read.
    """
    if what := _irregular(path):
        return what
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    start = _start(head)
    if what := _elsewhere(start):
        return what
    for first, what, remedy in _ARCHIVES:
        if start.startswith(first):
            return f"{what}: {remedy}"
    if start.startswith((b"<?xml", b"<error>")):
        return "an XML document, such as a server's error, not the data: download the file again"
    if start.startswith(_ZIP) and path.suffix.lower() not in ZIPPED:
        return "a ZIP archive: unpack it first"
    if head and not head.strip(b"\0"):
        return "nothing but zeros: copy or download it again"
    return None
