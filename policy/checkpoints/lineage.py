"""Lineage of weights: the data that they were trained on and its licences, in checkpoints' notes.

A checkpoint names its clips and imported pieces and those of the checkpoints that it was
initialised from. A licence for the weights is compared with these terms by what it restricts.
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

from policy.checkpoints.licences import UNKNOWN, restrictions, strictness

NOTE = "lineage"
NOT_STATED = "not stated"


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
        # of what was stated nothing is missing
        if not (stated and one.what == NOT_STATED)
    ]
    return "; ".join(dict.fromkeys(stated + inherited)) or NOT_STATED


def licence(notes: Mapping[str, str]) -> str:
    """Return the licence of weights, whole: the one stated, else those of their lineage."""
    return notes.get("licence") or terms(of(notes))


def origins(notes: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """Return data and licence of motions that policies of these notes make, as `trained_on` and
    `licence`; the texts of several policies are joined."""
    return {
        "trained_on": "; ".join(dict.fromkeys(data(one) for one in notes)),
        "licence": "; ".join(sorted(dict.fromkeys(licence(one) for one in notes), key=strictness)),
    }


OWN_LICENCE = "Apache-2.0"
"""Licence of the package's furniture"""


def with_furniture(licence: str, name: str, terms: str, credit: str) -> str:
    """Return the licence of a motion that shows a piece of furniture of these terms; those of the
    package's own add nothing."""
    if terms == OWN_LICENCE and not credit:
        return licence
    return f"{licence}; furniture {name}: {terms}{f', {credit}' if credit else ''}"


def terms(origins: Iterable[Origin]) -> str:
    """Return the licences of origins as one text, the most restrictive first."""
    found = dict.fromkeys(origin.licence for origin in origins)
    return "; ".join(sorted(found, key=strictness)) or NOT_STATED


def lost(text: str, origins: Iterable[Origin]) -> dict[Origin, frozenset[str]]:
    """Return what a licence for weights drops of the terms of each origin; empty if it keeps all.

    A licence keeps terms that are not known by quoting them.
    """
    kept = restrictions(text)
    found = {
        origin: restrictions(origin.licence) - kept
        for origin in origins
        if not _quotes(text, origin.licence)
    }
    unknown = {
        origin: frozenset({UNKNOWN}) for origin in found if UNKNOWN in restrictions(origin.licence)
    }
    return {origin: names for origin, names in (found | unknown).items() if names}


def _quotes(text: str, quoted: str) -> bool:
    """Whether a text holds another one as a part of its own, between its marks."""
    part = re.escape(_plain(quoted))
    return bool(part) and bool(re.search(rf'(?:^|[;:(",]) ?{part} ?(?:$|[;:)",.])', _plain(text)))


def _plain(text: str) -> str:
    return " ".join(text.casefold().split())
