"""Lineage of weights: what a licence restricts, and what it drops of the terms of the data."""

import pytest

from policy.checkpoints import lineage
from policy.checkpoints.lineage import Origin

SAMP = (
    "Licence: non-commercial research only. Derived from SAMP (Hassan et al., ICCV 2021), published"
    " under CC BY-NC-SA 4.0"
)
CMU = 'Licence: "This dataset of motions is free for all uses." "free for use in research projects"'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (SAMP, {"non-commercial use", "share alike", "attribution"}),
        (CMU, set()),
        ("research only, trained on SAMP", {"non-commercial use"}),
        ("Apache-2.0", {"attribution"}),
        ("MIT, (c) 2018 Xue Bin Peng", {"attribution"}),
        ("CC-BY 3.0, (c) 2010 Scopia", {"attribution"}),
        ("CC BY-SA 4.0", {"share alike", "attribution"}),
        ("CC BY-ND 4.0", {"no derivatives", "attribution"}),
        ("GPL-3.0", {"share alike", "attribution"}),
        ("CC0", set()),
        ("not stated", {lineage.UNKNOWN}),
        ("ask the author, by letter", {lineage.UNKNOWN}),
        ("", {lineage.UNKNOWN}),
    ],
)
def test_restrictions_by_the_words_of_a_licence(text: str, expected: set[str]) -> None:
    assert lineage.restrictions(text) == expected


def test_a_licence_keeps_the_terms_or_drops_some() -> None:
    samp, own, scopia = Origin("samp", SAMP), Origin("own", "Apache-2.0"), Origin("x", "CC-BY 3.0")
    assert not lineage.lost("Apache-2.0", [own, scopia])
    assert not lineage.lost("CC BY-NC-SA 4.0", [samp, own, scopia])
    assert lineage.lost("CC0", [own]) == {own: {"attribution"}}
    assert lineage.lost("Apache-2.0", [samp, own]) == {samp: {"non-commercial use", "share alike"}}
    assert lineage.lost("research only", [samp]) == {samp: {"share alike", "attribution"}}
    assert not lineage.lost(f"research only: {SAMP.upper()}", [samp])


def test_unknown_terms_are_kept_by_quoting_them_alone() -> None:
    unknown, odd = Origin("a folder"), Origin("b", "ask the author")
    assert lineage.lost("Apache-2.0", [unknown]) == {unknown: {lineage.UNKNOWN}}
    assert lineage.lost("my own terms", [odd]) == {odd: {lineage.UNKNOWN}}
    assert not lineage.lost("not stated", [unknown])
    assert not lineage.lost("ask  the author; attribution", [odd])


def test_the_notes_hold_all_of_it_in_full() -> None:
    origins = (Origin("own clips", "Apache-2.0"), Origin("samp", SAMP), Origin("c", "CC-BY", "Ann"))
    notes = {lineage.NOTE: lineage.note((*origins, origins[0]))}
    assert lineage.of(notes) == origins
    assert lineage.licence(notes) == f"{SAMP}; Apache-2.0; CC-BY"  # the strictest first
    assert lineage.data(notes) == "own clips; samp; c (Ann)"
    assert lineage.data(notes | {"data": "more"}) == "more; own clips; samp; c (Ann)"
    assert lineage.licence(notes | {"licence": "CC0"}) == "CC0"


def test_notes_of_earlier_versions_and_damaged_ones() -> None:
    older = {"data": "SAMP", "licence": "research only"}
    assert lineage.of(older) == (Origin("SAMP", "research only"),)
    assert lineage.of({"data_licences": "MIT"}) == (Origin("not stated", "MIT"),)
    assert lineage.of({}) == (Origin("not stated", "not stated"),)
    assert lineage.of(older | {lineage.NOTE: "[1]"}) == lineage.of(older)
    assert lineage.data({}) == lineage.licence({}) == "not stated"
