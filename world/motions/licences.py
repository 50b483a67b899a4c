"""The licence of motion files, from a file beside them or the README of their folder."""

from pathlib import Path

#: Characters of other text before the licence, from which on the sentences before it are left out.
_ASIDE = 100
_TERMS = ("non-commercial", "noncommercial", "research only")


def licence(folder: Path, file: str = "") -> str:
    """The licence line of the folder's README, or its line on terms of use; else `not stated`.

    The line is whole. A file FILE.license beside the file, as the REUSE specification names it,
    comes first.
    """
    beside = folder / f"{file}.license"
    if file and beside.is_file():
        return beside.read_text(errors="replace").strip().split("\n")[0] or "not stated"
    readme = folder / "README.md"
    if readme.is_file():
        lines = readme.read_text(errors="replace").splitlines()
        for words in (("licence", "license"), _TERMS):
            for line in lines:
                if any(word in line.lower() for word in words):
                    return _from(line.replace("**", ""), words)
    return "not stated"


def _from(line: str, words: tuple[str, ...]) -> str:
    """A line from the sentence with one of the words on, where that comes late."""
    at = min(place for word in words if (place := line.lower().find(word)) >= 0)
    start = 0 if at < _ASIDE else line.rfind(". ", 0, at) + 1
    return line[max(start, 0) :].strip(" -*")
