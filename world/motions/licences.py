"""The licence of a folder's files, from its README."""

from pathlib import Path

_LONGEST = 200
_TERMS = ("non-commercial", "noncommercial", "research only")


def licence(folder: Path) -> str:
    """The licence line of the folder's README, or its line on terms of use; else `not stated`."""
    readme = folder / "README.md"
    if readme.is_file():
        lines = readme.read_text(errors="replace").splitlines()
        for words in (("licence", "license"), _TERMS):
            for line in lines:
                if any(word in line.lower() for word in words):
                    return _from(line.replace("**", ""), words)
    return "not stated"


def _from(line: str, words: tuple[str, ...]) -> str:
    """A line, cut to 200 characters from the sentence with one of the words on."""
    at = min(place for word in words if (place := line.lower().find(word)) >= 0)
    start = 0 if at < _LONGEST // 2 else line.rfind(". ", 0, at) + 1
    return line[max(start, 0) :].strip(" -*")[:_LONGEST]
