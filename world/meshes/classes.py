"""The class of an imported piece: by the name of its file, folder or catalogue entry, else by its
shape."""

import re

from world.furniture.piece import Lying, SeatTarget

CLASSES = ("chair", "armchair", "low-stool", "high-stool", "sofa", "bed", "table")

_WORDS: tuple[tuple[str, str], ...] = (
    (r"arm[-_ ]?chair|fauteuil|recliner", "armchair"),
    (r"high[-_ ]?stool|bar[-_ ]?(stool|chair)", "high-stool"),
    (r"low[-_ ]?stool|bench|pouf|ottoman|footstool", "low-stool"),
    (r"table|desk", "table"),
    (r"sofa|couch|loveseat|settee", "sofa"),
    (r"bed|futon|mattress", "bed"),
    (r"chair", "chair"),
    (r"stool", "stool"),
)
_HIGH_M = 0.55
"""Least seat height of a high stool, m."""

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


def category_of_names(*names: str) -> str | None:
    """The class by the first name that contains a known word; `stool` for unknown height; None
    without one."""
    for name in names:
        for pattern, category in _WORDS:
            if re.search(pattern, name, re.IGNORECASE):
                return category
    return None


def category_of(
    category: str | None,
    size_m: tuple[float, float, float],
    sit: tuple[SeatTarget, ...],
    lie: Lying | None,
) -> str:
    """The given category, or that of the shape: size (x, y, z) m and targets."""
    if category is not None and category != "stool":
        return category
    seat = sit[0].point_m[2] if sit else 0.0
    if category == "stool":
        return "high-stool" if seat >= _HIGH_M else "low-stool"
    if lie is not None and size_m[0] > 1.7:
        return "bed"
    if not sit:
        return "table"
    backed = size_m[2] > seat + 0.2
    if size_m[1] > 1.2:
        return "sofa" if backed else "low-stool"
    if not backed:
        return "high-stool" if seat >= _HIGH_M else "low-stool"
    return "armchair" if size_m[1] > 0.62 else "chair"
