"""The terms of a file: beside it, in a catalogue, in README and LICENSE, here and above."""

from pathlib import Path

import pytest

from world.terms import Terms, of


def test_the_order_of_what_states_terms(tmp_path: Path) -> None:
    file = tmp_path / "set" / "s01" / "a.bvh"
    file.parent.mkdir(parents=True)
    assert of(file) == Terms()
    stated = {
        tmp_path / "LICENSE": "Creative Commons Attribution 4.0\n\nInternational Public License\n",
        tmp_path / "set" / "README.md": "# Set\nRead licences before use.\n- **Licence**: MIT\n",
        file.parent / "LICENSE.txt": "MIT License\n\nCopyright (c) 2020 Ann\n",
        file.parent / "Readme.txt": "For academic use; see the license: GPL\n",
        tmp_path / "INDEX.csv": "file,licence\na,CC0\n",
        file.parent / "a.bvh.license": "SPDX-FileCopyrightText: 2024 Bo\n"
        "SPDX-License-Identifier: CC-BY-4.0\n",
    }
    expected = [
        "Creative Commons Attribution 4.0 International Public License",
        "Licence: MIT",
        "MIT License Copyright (c) 2020 Ann",
        "For academic use; see the license: GPL",
        "CC0",
        "CC-BY-4.0, (c) 2024 Bo",
    ]
    for (path, text), licence in zip(stated.items(), expected, strict=True):
        path.write_text(text)
        assert of(file).licence == licence, path


@pytest.mark.parametrize(
    "text", ["Read licences before use.\n", "| folder | licence |\n", "My project is licensed.\n"]
)
def test_a_readme_above_must_state_a_licence_not_mention_one(tmp_path: Path, text: str) -> None:
    (tmp_path / "inner").mkdir()
    (tmp_path / "README.md").write_text(text)
    assert of(tmp_path / "inner" / "a.bvh") == Terms()


WRAPPED = """# Clips

About these clips: recorded
in 1999.
**Licence.** Free for all
uses, and not to be resold
as it is.

More of them.
"""


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("README.md", WRAPPED, "Licence. Free for all uses, and not to be resold as it is."),
        (
            "README.md",
            "Walks.\n\nWhoever uses them in a\nproduct does so under the\nlicense of the lab,"
            " and names\nit.\n- a list\n",
            "Whoever uses them in a product does so under the license of the lab, and names it.",
        ),
        ("README.md", "Author: A\nLicense: CC BY\nYear: 1999\n", "License: CC BY"),
        (
            "LICENSE",
            "MIT License\n\nCopyright (c) 2018 A\n\nPermission",
            "MIT License Copyright (c) 2018 A",
        ),
        (
            "LICENSE",
            "   Apache License\n   Version 2.0, January 2004\n   http://www.apache.org/\n",
            "Apache License Version 2.0, January 2004",
        ),
        (
            "LICENSE",
            "TERMS\n=====\nThese motions are free for research at universities\nand schools, and"
            " for nothing else.\n\nThe end.",
            "TERMS These motions are free for research at universities and schools, and for nothing"
            " else.",
        ),
        (
            "LICENSE",
            "These motions are free for research at universities\nand schools.\n\nNo more.",
            "These motions are free for research at universities and schools.",
        ),
    ],
)
def test_no_sentence_is_cut(name: str, text: str, said: str, tmp_path: Path) -> None:
    """Of texts whose lines are wrapped, and however long they are."""
    (tmp_path / name).write_text(text)
    assert of(tmp_path / "a.bvh").licence == said
    long = "Licence. " + "This is one of many words of a long licence; " * 40 + "the end."
    (tmp_path / "README.md").write_text(long)
    assert of(tmp_path / "a.bvh").licence == long


def test_source_and_authors_are_those_of_the_catalogue(tmp_path: Path) -> None:
    (tmp_path / "INDEX.csv").write_text("file,dataset,author\na.bvh,ACCAD,Ohio State\n")
    (tmp_path / "README.md").write_text("Licence: CC BY 3.0\n")
    assert of(tmp_path / "a.bvh") == Terms("Licence: CC BY 3.0", "ACCAD", "Ohio State")
    assert of(tmp_path / "b.bvh") == Terms("Licence: CC BY 3.0")
