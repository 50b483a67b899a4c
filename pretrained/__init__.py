"""Policies by name: `inhabit play sit` finds the folder `sit` here.

An installed package holds those that anyone may use; a checkout also holds those that were trained
on research-only motions, which their manifests say. In `stages` are networks that a training goes
on from: they have no names (`--init pretrained/stages/sit`).
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parent


def names() -> list[str]:
    """Return the names of the policies that are here, sorted."""
    return sorted(path.parent.name for path in ROOT.glob("*/manifest.json"))


def folder(name: str) -> Path | None:
    """Return the folder of a policy; None for another name."""
    return ROOT / name if name in names() else None
