"""Names in the state of a shard that older checkpoints have."""

from collections.abc import Mapping

from torch import Tensor

#: Prefixes of older checkpoints and what they are called today.
RENAMED = {"porter_": "teacher_", "patience_": "stall_"}


def current(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The state of a shard under today's names."""
    found = {}
    for name, value in state.items():
        old = next((prefix for prefix in RENAMED if name.startswith(prefix)), "")
        found[RENAMED.get(old, "") + name.removeprefix(old)] = value
    return found


def part(state: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    """The entries whose names begin with `prefix`, without it."""
    return {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}
