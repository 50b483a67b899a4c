"""Windows of consecutive states that the discriminator sees, from rollouts that follow one
another."""

from collections.abc import Mapping

import torch
from torch import Tensor

from discriminator.errors import StyleError
from discriminator.pairing import next_states
from world.device import CPU


class Windows:
    """Makes windows of `frames` states, of which 2 are the paper's transition.

    Of longer ones the earlier states may belong to the rollout before: the last states of every
    scene are kept. An episode has no states before its first, so that its first transitions have no
    whole window.
    """

    def __init__(self, frames: int, width: int, device: torch.device = CPU) -> None:
        """width: numbers of a state. Raises StyleError for fewer than 2 frames."""
        if frames < 2:
            raise StyleError(f"window {frames}: must be 2 states or more")
        self.frames, self._width = frames, width
        self._past = torch.empty(frames - 2, 0, width, device=device)
        self._age = torch.empty(0, dtype=torch.int64, device=device)

    def rows(
        self, states: Tensor, end_index: Tensor, end_states: Tensor, valid: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Windows [T·N, frames · width] of a rollout, oldest state first, time-major; and [T·N]
        bool: those that are whole. Others have copies of the episode's first state.

        Arguments as Discriminator.score, states [T+1, N, width]. Called once for each rollout.
        """
        after = next_states(states, end_index, end_states)
        if self.frames == 2:
            rows = torch.cat((states[:-1], after), -1).flatten(0, 1)
            return rows, torch.ones_like(valid).flatten()
        steps, scenes = valid.shape
        earlier = self.frames - 2
        if self._past.shape[1] != scenes:
            self._past = states[:1].expand(earlier, -1, -1)
            self._age = torch.zeros(scenes, dtype=torch.int64, device=states.device)
        joined = torch.cat((self._past, states))
        ended = ~valid
        ended[end_index[:, 0], end_index[:, 1]] = True
        ages, age = [], self._age
        for t in range(steps):
            ages.append(age)
            age = torch.where(ended[t], 0, (age + 1).clamp(max=earlier))
        found = torch.stack(ages)
        time = torch.arange(steps, device=states.device)[:, None] + earlier
        scene = torch.arange(scenes, device=states.device).expand(steps, -1)
        parts = [joined[time - found.clamp(max=back), scene] for back in range(earlier, -1, -1)]
        rows = torch.cat((*parts, after), -1).flatten(0, 1)
        self._past, self._age = joined[-1 - earlier : -1].nan_to_num(), age
        return rows, (found >= earlier).flatten()

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs; nothing for transitions."""
        if self.frames == 2:
            return {}
        return {"past": self._past.clone(), "age": self._age.clone()}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        if self.frames > 2:
            device = self._past.device
            self._past, self._age = (state[k].to(device, copy=True) for k in ("past", "age"))
