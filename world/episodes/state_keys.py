"""Renamed keys in the shard state of older checkpoints."""

from collections.abc import Mapping

from torch import Tensor

#: Today's prefixes by those of older checkpoints.
RENAMED = {"patience_": "stall_"}


def current(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The state of a shard under today's keys."""
    found = {}
    for name, value in state.items():
        old = next((prefix for prefix in RENAMED if name.startswith(prefix)), "")
        found[RENAMED.get(old, "") + name.removeprefix(old)] = value
    return found


def part(state: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The entries whose keys begin with `prefix`, with the prefix removed."""
    return {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}
