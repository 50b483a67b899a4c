"""Markdown tables and anchors."""

from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; pipes, line breaks and, outside inline code, `<` in its cells are escaped."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(_cell(c) for c in line) + " |" for line in lines) + "\n"


def code(text: object) -> str:
    """Inline code, empty for nothing."""
    shown = str(text)
    return f"`{shown}`" if shown else ""


def _cell(value: object) -> str:
    text = " ".join(str(value).split()).replace("|", "\\|")
    parts = text.split("`")  # every second one is code, where Markdown escapes
    return "`".join(p if k % 2 else p.replace("<", "&lt;") for k, p in enumerate(parts))
