"""Names survive whatever encoding they were written in."""

import pytest

from world.motions.text import decoded


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
