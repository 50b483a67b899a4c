"""Lineage of weights: what a licence restricts, and what it drops of the terms of the data."""

from policy.checkpoints import lineage
from policy.checkpoints.licences import UNKNOWN
from policy.checkpoints.lineage import Origin

SAMP = (
    "Licence: non-commercial research only. Derived from SAMP (Hassan et al., ICCV 2021), published"
    " under CC BY-NC-SA 4.0"
)
CMU = 'Licence: "This dataset of motions is free for all uses." "free for use in research projects"'


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
    assert lineage.lost("Apache-2.0", [unknown]) == {unknown: {UNKNOWN}}
    assert lineage.lost("my own terms", [odd]) == {odd: {UNKNOWN}}
    assert not lineage.lost("not stated", [unknown])
    assert not lineage.lost("ask  the author; attribution", [odd])
    assert lineage.lost("do not ask the author at all", [odd]) == {odd: {UNKNOWN}}


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


def test_a_motion_states_the_terms_of_its_policies_and_of_furniture_from_elsewhere() -> None:
    free = {"data": "own", "licence": "Apache-2.0"}
    strict = {"data": "SAMP", "licence": "CC BY-NC-SA 4.0"}
    found = lineage.origins([free, strict, free])
    assert found == {"trained_on": "own; SAMP", "licence": "CC BY-NC-SA 4.0; Apache-2.0"}
    assert lineage.with_furniture("A", "chair", "Apache-2.0", "") == "A"
    assert lineage.with_furniture("A", "chair", "unknown", "") == "A; furniture chair: unknown"
    said = lineage.with_furniture("A", "chair", "Apache-2.0", "Ada")
    assert said == "A; furniture chair: Apache-2.0, Ada"
