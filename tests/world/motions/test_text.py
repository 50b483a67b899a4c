"""Names survive whatever encoding they were written in."""

import pytest

from world.motions.text import decoded, lines, with_points


@pytest.mark.parametrize(
    ("name", "coding"),
    [
        ("Hüfte", "utf-8"), ("Hüfte", "utf-8-sig"), ("Hüfte", "latin-1"), ("Hüfte", "utf-16"),
        ("センター", "cp932"), ("センター", "utf-8"), ("Épaule gauche", "latin-1"),
        ("Hips", "ascii"),
    ],
)  # fmt: skip
def test_names_are_read(name: str, coding: str) -> None:
    assert decoded(f"JOINT {name}\n1.5 2\n".encode(coding)) == f"JOINT {name}\n1.5 2\n"


@pytest.mark.parametrize("coding", ["euc-kr", "gbk", "cp1251", "big5", "mac-roman"])
def test_other_encodings_keep_names_apart_and_numbers_whole(coding: str) -> None:
    names = {"cp1251": ("Бедро", "Колено"), "mac-roman": ("Hüfte", "Füße")}
    one, two = names.get(coding, ("左腿", "右腿") if coding != "euc-kr" else ("왼쪽", "오른쪽"))
    lines = decoded(f"{one}\n{two}\n{{ 1.5 -2 }}\n".encode(coding)).splitlines()
    assert lines[0] != lines[1] and lines[2] == "{ 1.5 -2 }"


def test_any_bytes_are_some_text() -> None:
    assert len(decoded(bytes(range(256)))) > 0


@pytest.mark.parametrize("tail", [b"\x1a", b"\r\n\x1a\r\n", b"\0\0\0", b"\n\0\x1a\0"])
def test_padding_behind_the_end_is_left_out(tail: bytes) -> None:
    assert decoded(b"MOTION\n1 2" + tail) == "MOTION\n1 2\n"


def test_lines_end_at_line_ends_alone() -> None:
    # 0x85 is an ellipsis of Windows, U+2028 a sign of UTF-8
    assert lines("a\x85b\u2028c\r\nd\re\n") == ["a\x85b\u2028c", "d", "e", ""]


def test_commas_and_exponents() -> None:
    assert with_points("1,5 -2,25") == "1.5 -2.25"
    assert with_points("1.5,2,3") == "1.5 2 3"
    assert with_points("1D0 2.5d-3") == "1e0 2.5e-3"
