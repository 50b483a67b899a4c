"""Text of motion files in whatever 8-bit encoding a program wrote it."""

import codecs

_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def decoded(data: bytes) -> str:
    """The text of a file's bytes: UTF-8, else Shift-JIS, else Windows Latin 1.

    Never fails: numbers and keywords are ASCII in all of them, and each other byte becomes a
    character, so that names stay distinct.
    """
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
