"""What licences restrict: a table of SPDX identifiers and the usual names of the same licences.

A text is read whole. What it holds beside known names and phrases counts as unknown terms where it
states a condition, and a text without any known name is unknown: an unknown licence is never taken
to be laxer than a known one.

Source of the identifiers: the SPDX License List (https://spdx.org/licenses/).
"""

import re
from functools import reduce

UNKNOWN = "unknown terms"
NO_COMMERCE = "non-commercial use"
NO_DERIVATIVES = "no derivatives"
SHARE_ALIKE = "share alike"
ATTRIBUTION = "attribution"
#: The restrictions, the strictest first.
RESTRICTIONS = (UNKNOWN, NO_COMMERCE, NO_DERIVATIVES, SHARE_ALIKE, ATTRIBUTION)

_Found = frozenset[str]
_NONE: _Found = frozenset()
_NAMED = frozenset({ATTRIBUTION})
_ALIKE = frozenset({ATTRIBUTION, SHARE_ALIKE})

_VERSION = r"(?:[- ,]*(?:version|v)?\.?[- ]?\d(?:\.\d)*\+?)?"
_KIND = r"(?:[- ]+(?:international|unported|generic|universal|deed|only|or[- ]later))*"
#: Creative Commons: CC-BY-NC-SA-4.0, cc by nc sa, Attribution-NonCommercial, addresses of deeds.
_COMMONS = re.compile(
    r"(?:https?://)?(?:www\.)?creativecommons\.org/(?:licenses|publicdomain)/(?P<deed>[a-z-]+)"
    r"(?:/[\w./]*)?"
    r"|\bcc(?:[- ]*by)(?P<short>(?:[- ]*(?:nc|nd|sa))*)\b" + _VERSION +
    r"(?P<late>(?:[- ](?:nc|nd|sa))*)\b" + _KIND +
    r"|\b(?:creative commons )?attribution(?P<long>(?:[-, ]*(?:non-?commercial|no-?deriv\w*"
    r"|share-?alike))+|(?<=creative commons attribution)(?!\w))" + _VERSION + _KIND +
    r"(?: (?:public )?licen[cs]e)?"
)  # fmt: skip

#: Other licences, by the pattern of their identifiers and names.
_TABLE: tuple[tuple[str, _Found], ...] = (
    (r"cc[- ]?0|cc[- ]zero|creative commons zero", _NONE),
    (r"(?:dedicated to |in )?(?:the )?public[- ]domain(?: dedication)?|pddl|unlicense"
     r"|the unlicense|wtfpl|0bsd|mit-0", _NONE),
    (r"apache(?: software)?(?: licen[cs]e)?(?:,)?|mit(?: licen[cs]e)?(?! +[a-z]{4})|expat"
     r"|(?:\d-clause[- ])?(?:new |modified |simplified )?bsd(?:[- ]\d(?:-clause)?)?"
     r"(?: licen[cs]e)?|isc|zlib|boost|bsl-1\.0|ncsa|postgresql|python-2\.0|psf-2\.0"
     r"|cdla-permissive|odc-by|open data commons attribution(?: licen[cs]e)?|artistic"
     r"|etalab|ogl-uk|dl-de-by", _NAMED),
    (r"[al]?gpl|gnu (?:lesser |affero )?(?:general )?public licen[cs]e|mpl"
     r"|mozilla public licen[cs]e|epl|eclipse public licen[cs]e|eupl|odbl"
     r"|open database licen[cs]e|ofl|cdla-sharing|lal|osl|cecill"
     r"|fdl|gfdl|free art licen[cs]e", _ALIKE),
)  # fmt: skip
_LICENCES = tuple(
    (re.compile(rf"\b(?:{names})\b{_VERSION}{_KIND}"), found) for names, found in _TABLE
)
#: Phrases of terms, and what they restrict.
_PHRASES: tuple[tuple[str, _Found], ...] = (
    (r"(?:for )?non[- ]?commercial(?:ly)?(?: and)?(?: (?:scientific|academic|educational))?"
     r"(?: research)?(?: purposes| use)?(?: only)?|never commercially"
     r"|not (?:for|available for) (?:any )?commercial (?:use|purposes?)|no commercial use"
     r"|(?:for )?(?:academic |scientific )?(?:research|academic|education(?:al)?)"
     r"(?: (?:use|purposes?))? only|only for (?:academic |scientific )?(?:research|academic use)"
     r"|personal use only", frozenset({NO_COMMERCE})),
    (r"no[- ]?derivatives?(?: works?)?", frozenset({NO_DERIVATIVES})),
    (r"share[- ]?alike", frozenset({SHARE_ALIKE})),
    (r"(?:with )?attribution(?: needed| required)?|with credit|acknowledge?ments?"
     r"(?: asked for| required)?|must be acknowledged|please (?:cite|acknowledge)[^.;]*",
     frozenset({ATTRIBUTION})),
    # CMU's terms bar the resale of the data itself, which weights are not
    (r"free for all uses|free for use in research projects"
     r"|you may include this data in commercially-sold products"
     r"|,? ?but you may not resell this data directly,? even in converted form|not to be resold"
     r"|may be copied, modified,? or redistributed without\W+explicit permission", _NONE),
    (r"(?:adds? |with(?:out)? )?no (?:further |other )?restrictions?", _NONE),
)  # fmt: skip
_KNOWN_PHRASES = tuple((re.compile(rf"\b(?:{words})\b"), found) for words, found in _PHRASES)
#: Phrases of permission alone: without a name of a licence a text needs one to be known.
_FREE = re.compile(r"\bfree for all uses\b")
#: A negation in front turns a name or phrase into a condition that is not known.
_NEGATED = re.compile(
    r"\b(?:not|no longer|isn't|nor|never|neither|except|excluding)\s+(?:\w+\s+)?$"
)
#: Words that state a condition.
_CONDITION = re.compile(
    r"\b(?:(?:may|must|can|shall|should) ?not|cannot|must|shall|only|prohibit\w*|forbid\w*"
    r"|restrict\w*|permission|permitted|allowed|unless|except\w*|excluding"
    r"|on request|ask|all rights reserved"
    r"|proprietary|confidential|commons[- ]clause|not? \w+ (?:use|purposes?)"
    r"|nc|nd|not free|not (?:in )?(?:the )?public|(?<!could )not (?:be|for|to be)"
    r"|(?:is|are|'s) not)\b"
)  # fmt: skip


def restrictions(text: str) -> frozenset[str]:
    """Return what a licence restricts: of RESTRICTIONS, UNKNOWN included.

    Of licences that are joined by OR one may choose: what all of them restrict; with an unknown one
    among them, what any does. Of those joined in any other way all hold.
    """
    choices = re.split(r"\s+(?:OR|or)\s+(?!later)", text)
    if len(choices) > 1:
        found = [_of(choice) for choice in choices]
        return reduce(frozenset.union if any(UNKNOWN in one for one in found) else
                      frozenset.intersection, found)  # fmt: skip
    return _of(text)


def strictness(text: str) -> int:
    """Return a number to sort licences by, smaller for stricter ones."""
    found = restrictions(text)
    return next((i for i, name in enumerate(RESTRICTIONS) if name in found), len(RESTRICTIONS))


def _of(text: str) -> frozenset[str]:
    rest = " ".join(text.casefold().replace("’", "'").split())
    found: set[str] = set()
    known = False

    def take(pattern: re.Pattern[str], restricts: frozenset[str] | None, names: bool) -> None:
        """Take the matches of a pattern out of the text; None: a licence of Creative Commons."""
        nonlocal rest, known

        def taken(match: re.Match[str]) -> str:
            nonlocal known
            if _NEGATED.search(match.string[: match.start()]):
                return match[0]
            found.update(_commons(match) if restricts is None else restricts)
            known = known or names or bool(restricts)
            return " § "

        rest = pattern.sub(taken, rest)

    known = bool(_FREE.search(rest)) and not re.search(r"\bnot free for all uses\b", rest)
    take(_COMMONS, None, names=True)
    for pattern, restricts in _KNOWN_PHRASES[:1]:  # before the names: "no commercial use"
        take(pattern, restricts, names=False)
    for pattern, restricts in _LICENCES:
        take(pattern, restricts, names=True)
    for pattern, restricts in _KNOWN_PHRASES[1:]:
        take(pattern, restricts, names=False)
    if not known or _CONDITION.search(rest):
        found.add(UNKNOWN)
    return frozenset(found)


def _commons(match: re.Match[str]) -> frozenset[str]:
    """The restrictions of a licence of Creative Commons by its elements."""
    deed = match["deed"] or ""
    if deed in ("zero", "mark", "publicdomain"):
        return _NONE
    elements = " ".join(match[name] or "" for name in ("deed", "short", "late", "long"))
    return frozenset({ATTRIBUTION}) | {
        name
        for name, pattern in (
            (NO_COMMERCE, r"\bnc|non-?commercial"),
            (NO_DERIVATIVES, r"\bnd|no-?deriv"),
            (SHARE_ALIKE, r"\bsa|share-?alike"),
        )
        if re.search(pattern, elements)
    }
