"""Lineage of weights: the data that they were trained on and its licences, in checkpoints' notes.

A checkpoint names its clips and imported pieces and those of the checkpoints that it was
initialised from. A licence for the weights is compared with these terms by what it restricts.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass

NOTE = "lineage"
NOT_STATED = "not stated"
UNKNOWN = "unknown terms"
#: Restrictions by the words that state them, the strictest first.
_RESTRICTIONS = {
    "non-commercial use": r"non[- ]?commercial|\bnc\b|(research|academic)[- ](use[- ])?only"
    r"|only for research",
    "no derivatives": r"\bnd\b|no[- ]?deriv",
    "share alike": r"\bsa\b|share[- ]?alike|\b[al]?gpl",
    "attribution": r"\bcc[- ]by\b|attribution|acknowledg|apache|\bmit\b|\bbsd\b|\b[al]?gpl",
}
_FREE = r"\bcc0\b|cc[- ]zero|public domain|unlicense|free for all uses"


@dataclass(frozen=True)
class Origin:
    """One source of the data that weights were trained on."""

    what: str
    licence: str = NOT_STATED
    credit: str = ""
    """Authors, where the licence requires attribution."""


def note(origins: Iterable[Origin]) -> str:
    """Return origins as the text of a note, without repetitions."""
    return json.dumps([asdict(origin) for origin in dict.fromkeys(origins)])


def of(notes: Mapping[str, str]) -> tuple[Origin, ...]:
    """Return the origins in a checkpoint's notes; without them one, of what older notes tell."""
    try:
        rows = json.loads(notes[NOTE])
        return tuple(
            Origin(str(row["what"]), str(row["licence"]), str(row["credit"])) for row in rows
        )
    except (KeyError, ValueError, TypeError):
        licence = notes.get("licence") or notes.get("data_licences") or NOT_STATED
        return (Origin(notes.get("data") or NOT_STATED, licence),)


def data(notes: Mapping[str, str]) -> str:
    """Return the training data of weights, whole: what was stated, and their lineage."""
    stated = [notes["data"]] if notes.get("data") else []
    inherited = [
        f"{one.what} ({one.credit})" if one.credit else one.what
        for one in (of(notes) if NOTE in notes else ())
    ]
    return "; ".join(dict.fromkeys(stated + inherited)) or NOT_STATED


def licence(notes: Mapping[str, str]) -> str:
    """Return the licence of weights, whole: the one stated, else those of their lineage."""
    return notes.get("licence") or terms(of(notes))


def terms(origins: Iterable[Origin]) -> str:
    """Return the licences of origins as one text, the most restrictive first."""
    found = dict.fromkeys(origin.licence for origin in origins)
    return "; ".join(sorted(found, key=_strictness)) or NOT_STATED


def restrictions(text: str) -> frozenset[str]:
    """Return what a licence restricts, by its words; UNKNOWN for words that state none."""
    found = frozenset(
        name for name, words in _RESTRICTIONS.items() if re.search(words, text, re.IGNORECASE)
    )
    if found or re.search(_FREE, text, re.IGNORECASE):
        return found
    return frozenset({UNKNOWN})


def lost(text: str, origins: Iterable[Origin]) -> dict[Origin, frozenset[str]]:
    """Return what a licence for weights drops of the terms of each origin; empty if it keeps all.

    A licence that quotes the terms of an origin keeps them.
    """
    kept = restrictions(text)
    found = {
        origin: restrictions(origin.licence) - kept
        for origin in origins
        if _plain(origin.licence) not in _plain(text) or not _plain(origin.licence)
    }
    unknown = {
        origin: frozenset({UNKNOWN}) for origin in found if UNKNOWN in restrictions(origin.licence)
    }
    return {origin: names for origin, names in (found | unknown).items() if names}


def _plain(text: str) -> str:
    return " ".join(text.casefold().split())


def _strictness(text: str) -> int:
    found = restrictions(text)
    return next((i for i, name in enumerate(_RESTRICTIONS) if name in found), len(_RESTRICTIONS))
