"""Text of motion files in whatever 8-bit encoding a program wrote it."""

import codecs
import re

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def decoded(data: bytes) -> str:
    """The text of a file's bytes without padding at its end: UTF-8, else Shift-JIS, else Windows
    Latin 1.

    Never fails: numbers and keywords are ASCII in all of them, and each other byte becomes a
    character, so that names stay distinct.
    """
    text = _decoded(data)
    end = len(text.rstrip("\0\x1a \t\r\n"))
    padded = any(sign in text[end:] for sign in "\0\x1a")
    return text[:end] + "\n" if padded else text


def _decoded(data: bytes) -> str:
    for mark, coding in _MARKS:
        if data.startswith(mark):
            return data[len(mark) :].decode(coding, errors="replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        pass
    # Latin 1 has no letters from 0x80 to 0x9f, where Shift-JIS has the lead bytes of kana
    if any(0x80 <= byte <= 0x9F for byte in data):
        try:
            return data.decode("cp932")
        except UnicodeDecodeError:
            pass
    return data.decode("latin-1")


def lines(text: str) -> list[str]:
    """The lines of a text. Unlike those of str.splitlines, they end at line feeds and carriage
    returns alone: 0x85 is a letter or a sign of many 8-bit encodings."""
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def with_points(text: str) -> str:
    """The text with decimal points for decimal commas, or spaces for separating ones, and with
    e for the exponents of Fortran."""
    text = re.sub(r"(?<=[\d.])[dD](?=[+-]?\d)", "e", text)
    if "," not in text:
        return text
    separates = "." in text or re.search(r",[-+]?\d*,", text) is not None
    return text.replace(",", " " if separates else ".")


class Names:
    """Names, found in another case as well where that is one name."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = frozenset(names)
        self._folded: dict[str, str | None] = {}
        for name in names:
            folded = name.casefold()
            self._folded[folded] = None if folded in self._folded else name

    def spelled(self, word: str) -> str | None:
        """The name that a word means; None for none, or for several."""
        return word if word in self._names else self._folded.get(word.casefold())
