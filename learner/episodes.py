"""Statistics of the last episodes, over all and by kind of start."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

KEYS = ("return", "length", "success", "fall", "start")


class EpisodeWindow:
    """The last `size` finished episodes, oldest first."""

    def __init__(self, size: int, starts: Sequence[str] = ()) -> None:
        self.size = size
        self.starts = tuple(starts)
        self._held: dict[str, Tensor] = {key: torch.zeros(0) for key in KEYS}

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Append finished episodes, [K] by key."""
        self._held = {
            key: torch.cat((self._held[key], episodes[key].float()))[-self.size :] for key in KEYS
        }

    def metrics(self) -> dict[str, float]:
        """Means by `episode/<key>`; nothing until an episode has ended."""
        start = self._held["start"]
        if len(start) == 0:
            return {}
        found = {f"episode/{key}": float(self._held[key].mean()) for key in KEYS[:-1]}
        for number, name in enumerate(self.starts):
            chosen = start == number
            if chosen.any():
                found[f"episode/success_{name}"] = float(self._held["success"][chosen].mean())
                found[f"episode/fall_{name}"] = float(self._held["fall"][chosen].mean())
                found[f"episode/length_{name}"] = float(self._held["length"][chosen].mean())
        return found

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        return dict(self._held)

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._held = {key: state[key].clone() for key in KEYS}
