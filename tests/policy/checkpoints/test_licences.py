"""What licences restrict, by identifier, name and address; the identifiers are SPDX's."""

import pytest

from policy.checkpoints.licences import (
    ATTRIBUTION,
    NO_COMMERCE,
    NO_DERIVATIVES,
    SHARE_ALIKE,
    UNKNOWN,
    restrictions,
    strictness,
)

SAMP = (
    "Licence: non-commercial research only. Derived from SAMP (Hassan et al., ICCV 2021), published"
    " under CC BY-NC-SA 4.0"
)
CMU = (
    'Licence: "This dataset of motions is free for all uses." "This data is free for use in'
    " research projects. You may include this data in commercially-sold products, but you may not"
    ' resell this data directly, even in converted form."'
)
EXPECTED: dict[frozenset[str], tuple[str, ...]] = {
    frozenset(): (
        CMU, "CC0", "CC0-1.0", "Unlicense", "public domain", "CC0-1.0 OR CC-BY-NC-4.0",
        "https://creativecommons.org/publicdomain/zero/1.0/",
    ),
    frozenset({ATTRIBUTION}): (
        "Apache-2.0", "Apache License, Version 2.0", "MIT", "MIT, (c) 2018 Xue Bin Peng",
        "BSD-3-Clause", "3-clause BSD", "CC-BY-4.0", "CC-BY 3.0, (c) 2010 Scopia", "cc by",
        "Creative Commons Attribution 3.0 Unported License (CC BY 3.0)", "MIT OR GPL-3.0-only",
        "Apache-2.0; data: ACCAD CC BY 3.0 (The Ohio State University)",
    ),
    frozenset({ATTRIBUTION, SHARE_ALIKE}): (
        "CC BY-SA 4.0", "GPL-3.0", "GPL-3.0-or-later", "LGPL-2.1 or later", "ODbL-1.0",
        "Apache-2.0 AND CC-BY-SA-4.0", "Free Art License 1.3, (c) eTeks",
    ),
    frozenset({ATTRIBUTION, NO_COMMERCE}): (
        "CC-BY-NC-4.0", "CC BY NC", "CCBYNC", "CC0; CC-BY-NC 4.0", "Apache-2.0, non-commercial",
        "Creative Commons Attribution-NonCommercial 4.0 International", "CC-BY-4.0-NC",
    ),
    frozenset({ATTRIBUTION, NO_DERIVATIVES}): ("CC BY-ND 4.0",),
    frozenset({ATTRIBUTION, NO_DERIVATIVES, NO_COMMERCE}): (
        "https://creativecommons.org/licenses/by-nc-nd/4.0/",
    ),
    frozenset({ATTRIBUTION, SHARE_ALIKE, NO_COMMERCE}): (
        SAMP, "CC-BY-NC-SA-4.0", "research only, trained on SAMP (CC BY-NC-SA 4.0)",
    ),
    frozenset({NO_COMMERCE}): ("research only", "academic use only", "Non commercial"),
    frozenset({ATTRIBUTION, UNKNOWN}): (
        "MIT but no military use", "Apache License 2.0 with Commons Clause",
        "CC-BY-4.0, except for training",
    ),
    frozenset({UNKNOWN}): (
        "", "not stated", "unknown", "ask the author, by letter", "Not free for all uses",
        "this is not CC0", "not public domain", "all rights reserved", "Foo-1.0", "my own terms",
        "LicenseRef-Mine", "free", "may not be used commercially", "Mit freundlichen Grüssen",
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "expected"), [(text, found) for found, texts in EXPECTED.items() for text in texts]
)
def test_restrictions(text: str, expected: frozenset[str]) -> None:
    assert restrictions(text) == expected
    assert restrictions(text.upper().replace(" OR ", " or ")) >= expected - {UNKNOWN}


def test_a_choice_with_an_unknown_licence_keeps_both() -> None:
    assert restrictions("CC0 OR LicenseRef-Mine") == {UNKNOWN}
    assert restrictions("MIT or my terms") == {UNKNOWN, ATTRIBUTION}
    assert restrictions("CC0-1.0 AND LicenseRef-Mine, ask me") == {UNKNOWN}


def test_the_strictest_comes_first() -> None:
    texts = ["CC0", "MIT", "GPL-3.0", "CC-BY-ND-4.0", "CC-BY-NC-4.0", "my terms"]
    assert sorted(texts, key=strictness) == texts[::-1]
