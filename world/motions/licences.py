"""The licence of a folder's files, from its README."""

from pathlib import Path


def licence(folder: Path) -> str:
    """The licence line of the folder's README, or `not stated`."""
    readme = folder / "README.md"
    if readme.is_file():
        for line in readme.read_text(errors="replace").splitlines():
            if "licence" in line.lower() or "license" in line.lower():
                return line.replace("**", "").strip(" -*")[:200]
    return "not stated"
