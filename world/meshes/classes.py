"""The class of an imported piece: by its shape; among the classes that the shape allows, by whole
words of its file, folder or catalogue entry."""

import re
from dataclasses import dataclass

from world.furniture.affordance import relief as reliefs
from world.furniture.affordance import seats
from world.furniture.affordance.relief import Relief
from world.furniture.piece import Lying, SeatTarget

CLASSES = ("chair", "armchair", "low-stool", "high-stool", "sofa", "bed", "table")

_WORDS: dict[str, str] = {
    "armchair": "armchair",
    "fauteuil": "armchair",
    "recliner": "armchair",
    "chair": "chair",
    "seat": "chair",
    "barstool": "high-stool",
    "highstool": "high-stool",
    "lowstool": "low-stool",
    "footstool": "low-stool",
    "bench": "low-stool",
    "pouf": "low-stool",
    "pouffe": "low-stool",
    "ottoman": "low-stool",
    "hassock": "low-stool",
    "stool": "stool",
    "table": "table",
    "desk": "table",
    "sofa": "sofa",
    "couch": "sofa",
    "loveseat": "sofa",
    "settee": "sofa",
    "bed": "bed",
    "daybed": "bed",
    "futon": "bed",
    "mattress": "bed",
}
_PAIRS: dict[tuple[str, str], str] = {
    ("arm", "chair"): "armchair",
    ("high", "stool"): "high-stool",
    ("bar", "stool"): "high-stool",
    ("bar", "chair"): "high-stool",
    ("low", "stool"): "low-stool",
    ("foot", "stool"): "low-stool",
    ("love", "seat"): "sofa",
}
_JOINING = {"with", "for", "of", "from", "in", "on", "by", "without", "and"}
"""Words after which a name states something else: a chair for a desk."""
_OTHERS = {
    "lamp",
    "light",
    "clock",
    "cabinet",
    "nightstand",
    "cloth",
    "cover",
    "linen",
    "leg",
    "legs",
}
"""Nouns that make another object of a class: a table lamp."""

_HIGH_M = 0.55
"""Least seat height of a high stool, m."""
_WORKTOP_M = 0.58
"""Least height of a seat with a back that is a bar stool's or a desk's."""
_LYING_M, _BED_M = 1.65, 0.65
"""Least length and width of a bed."""
_FOR_ONE_M = 0.85
"""Greatest width of a chair; broader ones are armchairs or sofas."""
_FOR_TWO_M = 1.10
"""Least width of a sofa."""
_DEEP_M = 0.75
"""Greatest depth of a bench."""
_TABLE_M = 0.25
"""Least height of a table."""

DENSITY_KG_M3 = {
    "chair": 450.0,
    "armchair": 80.0,
    "low-stool": 250.0,
    "high-stool": 350.0,
    "sofa": 60.0,
    "bed": 70.0,
    "table": 700.0,
}
"""Mean density of the hulls by class, ours: ordinary pieces then have the mass of the package's
own; upholstery and frames are mostly air."""

LEAST_KG = {
    "chair": 4.0,
    "armchair": 9.0,
    "low-stool": 3.0,
    "high-stool": 4.0,
    "sofa": 30.0,
    "bed": 35.0,
    "table": 8.0,
}
"""Least mass by class, about that of the package's own: a bare frame is of no foam."""


@dataclass(frozen=True)
class Shape:
    """What the geometry says of a piece's class."""

    size_m: tuple[float, float, float]
    """x, y, z."""
    seat_m: float | None
    """Height of the first seat; None without one."""
    backed: bool
    """Whether that seat has a back."""
    lies: bool
    """Whether there is a lying target."""
    top_m: float
    """Height of the level of the largest area."""
    top_share: float
    """Its fraction of the bounding rectangle."""


TOP_SHARE = 0.35
"""Least fraction of the floor area that a table's top covers."""


def shape_of(
    size_m: tuple[float, float, float],
    surface: Relief,
    sit: tuple[SeatTarget, ...],
    lie: Lying | None,
) -> Shape:
    """The shape of a piece of this size with these targets."""
    top, share = reliefs.main_level(surface)
    seat = sit[0].point_m[2] if sit else None
    backed = bool(sit) and seats.backed(surface, sit[0])
    return Shape(size_m, seat, backed, lie is not None, top, share)


def possible(shape: Shape) -> tuple[str, ...]:
    """The classes that the shape allows, the likeliest first; empty where it is no furniture."""
    long, short = max(shape.size_m[:2]), min(shape.size_m[:2])
    found: list[str] = []
    bed = shape.lies and long >= _LYING_M and short >= _BED_M
    table = shape.top_share >= TOP_SHARE and shape.top_m >= _TABLE_M
    # a bed's head is at its back: it is longer than broad
    if bed and shape.size_m[0] > 1.7:
        found.append("bed")
    if shape.seat_m is None:
        found += ["table"] * table
    elif shape.backed and shape.seat_m >= _WORKTOP_M:
        # broader ones are desks with a hutch, or large sofas
        broad = ["sofa", "table"] if shape.lies else ["table", "high-stool", "sofa"]
        found += ["high-stool"] if long <= _FOR_ONE_M else broad
    elif shape.backed and long >= _FOR_TWO_M:
        found += ["sofa"] if short >= 0.5 else []
        found += ["low-stool"] if short <= _DEEP_M else []
        found += ["armchair"] if long <= 1.4 else []
    elif shape.backed:
        found += ["chair", "armchair"] if shape.size_m[1] <= 0.62 else ["armchair", "chair"]
        found += ["low-stool"]
    elif shape.seat_m >= _HIGH_M:
        stool = ["high-stool"] if short <= 0.7 else []
        found += [*stool, "table"] if long <= _FOR_ONE_M else ["table", *stool]
    else:
        found += ["low-stool", "table"] if long <= 1.0 or short <= 0.5 else ["table", "low-stool"]
        found += ["sofa"] if long >= _FOR_TWO_M and short >= 0.5 else []
        # shells, folding chairs, and chairs whose back no pelvis touches
        found += ["chair", "armchair"] if long <= _FOR_ONE_M else []
    if bed:
        found.append("bed")
    return tuple(dict.fromkeys(found))


def category_of_names(*names: str) -> str | None:
    """The class by the first name with a known word, its last such word: a desk chair is a chair;
    `stool` for unknown height; None without one, or where the word belongs to another object."""
    for name in names:
        found = None
        words = _split(name)
        for before, word in zip(["", *words], words, strict=False):
            if word in _JOINING and found is not None:
                break
            if word in _OTHERS:
                found = None
            found = _PAIRS.get((before, word)) or _WORDS.get(word) or found
        if found is not None:
            return found
    return None


def _split(name: str) -> list[str]:
    """The words of a name in lower case, singular: at signs, digits and capitals."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = re.findall(r"[^\W\d_]+", spaced)
    lower = [word.lower() for word in words]
    return [
        singular
        if (singular := word.removesuffix("s")) in _WORDS
        else singular
        if (singular := word.removesuffix("es")) in _WORDS
        else word
        for word in lower
    ]


def category_of(named: str | None, shape: Shape) -> tuple[str | None, str]:
    """The class of a shape, and a remark where the name states one that the shape does not allow;
    None where it is no furniture."""
    allowed = possible(shape)
    if named == "stool":
        named = "high-stool" if (shape.seat_m or shape.top_m) >= _HIGH_M else "low-stool"
    if not allowed:
        return None, ""
    if named is None or named in allowed:
        return named or allowed[0], ""
    seat = "no seat" if shape.seat_m is None else f"a seat at {shape.seat_m:.2f} m"
    back = "" if shape.seat_m is None else " with a back" if shape.backed else " without a back"
    return allowed[0], (
        f"named a {named}, imported as a {allowed[0]} by its shape ({seat}{back}); "
        f"--category {named} overrides"
    )
