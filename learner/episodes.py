"""Statistics of the last episodes, over all and by kind of start."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

KEYS = ("return", "length", "success", "fall", "start")
#: Figures of this prefix are a task's own: whether an episode reached one of its stages.
STAGE = "stage_"
#: By what an episode ended, where a task tells.
END = "end_"
#: Whether patience with an episode ended; windows that were saved before there was any lack it.
STALLED = "stalled"


class EpisodeWindow:
    """The last `size` finished episodes, oldest first."""

    def __init__(self, size: int, starts: Sequence[str] = ()) -> None:
        self.size = size
        self.starts = tuple(starts)
        self._held: dict[str, Tensor] = {key: torch.zeros(0) for key in KEYS}

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Append finished episodes, [K] by key: KEYS, STALLED and any stages."""
        more = [key for key in episodes if _may_lack(key)]
        unknown = torch.full_like(self._held["start"], torch.nan)
        self._held = {
            key: torch.cat((self._held.get(key, unknown), episodes[key].float()))[-self.size :]
            for key in (*KEYS, *more)
        }

    def metrics(self) -> dict[str, float]:
        """Means by `episode/<key>`; nothing until an episode has ended."""
        start = self._held["start"]
        if len(start) == 0:
            return {}
        found = {f"episode/{key}": float(self._held[key].mean()) for key in KEYS[:-1]}
        more = [key for key in self._held if _may_lack(key)]
        found |= {f"episode/{key}": float(self._held[key].nanmean()) for key in more}
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
        self._held = {key: value.clone() for key, value in state.items()}


def _may_lack(key: str) -> bool:
    return key == STALLED or key.startswith((STAGE, END))
