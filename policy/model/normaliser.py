"""Normalisers of observations and returns by running mean and variance."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class NormaliserConfig:
    """Clip and floor of a normaliser."""

    clip: float = 5.0
    """Greatest magnitude of a normalised input; larger ones are clipped."""
    std_floor: float = 1e-2
    """Least standard deviation that an input is divided by, in the input's units."""


def normalise(x: Tensor, mean: Tensor, std: Tensor, clip: float) -> Tensor:
    """(x - mean) / std, clipped at ±clip; [.., d] with mean and std [d]."""
    return ((x - mean) / std).clamp_(-clip, clip)


class Normaliser:
    """Mean and variance [d] of all rows so far, float64 (pairwise merge, Chan et al. 1979)."""

    def __init__(self, width: int, config: NormaliserConfig | None = None) -> None:
        self.config = config or NormaliserConfig()
        self.mean = torch.zeros(width, dtype=torch.float64)
        self.variance = torch.ones(width, dtype=torch.float64)
        self.count = torch.zeros(width, dtype=torch.float64)

    @property
    def std(self) -> Tensor:
        """Standard deviation [d], float32, not below the floor."""
        return self.variance.sqrt().clamp(min=self.config.std_floor).float()

    def update(self, rows: Tensor) -> None:
        """Merge a batch of rows [n, d]; an empty batch changes nothing."""
        n = rows.shape[0]
        if n == 0:
            return
        rows = rows.double()
        variance, mean = torch.var_mean(rows, dim=0, correction=0)
        total = self.count + n
        delta = mean - self.mean
        # The initial variance of 1 has count 0, so it does not enter the merge.
        squares = self.variance * self.count + variance * n
        squares += delta.square() * self.count * n / total
        self.mean = self.mean + delta * n / total
        self.variance = squares / total
        self.count = total

    def to(self, device: torch.device) -> None:
        """Move to a device."""
        self.mean, self.variance, self.count = (
            moment.to(device) for moment in (self.mean, self.variance, self.count)
        )

    def __call__(self, rows: Tensor) -> Tensor:
        """Normalised and clipped rows [.., d], float32."""
        return normalise(rows, self.mean.float(), self.std, self.config.clip)

    def published(self) -> dict[str, Tensor]:
        """Tensors for acting: mean [d], std [d] and clip [], float32."""
        clip = torch.tensor(self.config.clip, dtype=torch.float32)
        return {"mean": self.mean.float(), "std": self.std, "clip": clip}

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs, float64 [d] each."""
        return {
            "mean": self.mean.clone(),
            "variance": self.variance.clone(),
            "count": self.count.clone(),
        }

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        mean, variance, count = (
            state[name].to(self.mean.device).double().clone()
            for name in ("mean", "variance", "count")
        )
        self.mean, self.variance, self.count = mean, variance, count


class ValueNormaliser:
    """Mean and standard deviation of the returns, by which the critic's targets are scaled."""

    def __init__(self, memory: float = 2e6, std_floor: float = 1e-2) -> None:
        self._moments = Normaliser(1, NormaliserConfig(std_floor=std_floor))
        self._memory = memory

    @property
    def mean(self) -> float:
        """Mean return."""
        return float(self._moments.mean[0])

    @property
    def std(self) -> float:
        """Standard deviation of the returns, not below the floor."""
        return float(self._moments.std[0])

    @property
    def fresh(self) -> bool:
        """Whether no batch is merged yet."""
        return float(self._moments.count[0]) == 0.0

    def update(self, returns: Tensor) -> None:
        """Merge returns [n]; the count is capped at `memory`, because returns grow in training."""
        self._moments.update(returns.reshape(-1, 1))
        self._moments.count = self._moments.count.clamp(max=self._memory)

    def to(self, device: torch.device) -> None:
        """Move to a device."""
        self._moments.to(device)

    def normalise(self, values: Tensor) -> Tensor:
        """Normalised values of returns, any shape."""
        return (values - self.mean) / self.std

    def denormalise(self, values: Tensor) -> Tensor:
        """Returns of normalised values, any shape."""
        return values * self.std + self.mean

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact restart needs."""
        return self._moments.state_dict()

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave."""
        self._moments.load_state_dict(state)
