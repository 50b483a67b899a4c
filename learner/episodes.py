"""Statistics of the last episodes, over all and by category of initial state."""

from collections.abc import Mapping, Sequence

import torch
from torch import Tensor

KEYS = ("return", "length", "success", "fall", "start")
#: Prefix of a task's own statistics: whether an episode reached a stage of the task.
STAGE = "stage_"
#: Prefix of the causes of failure that a task distinguishes.
END = "end_"
#: Whether the stall time-out ended an episode; windows of early runs lack it.
STALLED = "stalled"


class EpisodeWindow:
    """The last `size` finished episodes, oldest first."""

    def __init__(self, size: int, categories: Sequence[str] = ()) -> None:
        self.size = size
        self.categories = tuple(categories)
        self._held: dict[str, Tensor] = {key: torch.zeros(0) for key in KEYS}

    def add(self, episodes: Mapping[str, Tensor]) -> None:
        """Append K finished episodes: [K] under each of KEYS, STALLED and the stages."""
        more = [key for key in episodes if _may_lack(key)]
        unknown = torch.full_like(self._held["start"], torch.nan)
        self._held = {
            key: torch.cat((self._held.get(key, unknown), episodes[key].float()))[-self.size :]
            for key in (*KEYS, *more)
        }

    def __len__(self) -> int:
        """Number of episodes in the window."""
        return len(self._held["start"])

    def metrics(self) -> dict[str, float]:
        """Means by `episode/<key>`; empty until an episode has ended."""
        start = self._held["start"]
        if len(start) == 0:
            return {}
        found = {f"episode/{key}": float(self._held[key].mean()) for key in KEYS[:-1]}
        # no episode may have ended yet of the task that records it
        more = [k for k in self._held if _may_lack(k) and not self._held[k].isnan().all()]
        found |= {f"episode/{key}": float(self._held[key].nanmean()) for key in more}
        for number, name in enumerate(self.categories):
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
        """Restore a state."""
        self._held = {key: value.clone() for key, value in state.items()}


def _may_lack(key: str) -> bool:
    return key == STALLED or key.startswith((STAGE, END))
