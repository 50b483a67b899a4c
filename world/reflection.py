"""A reflection of vectors of features or actions: each number is another one, or its negative."""

from dataclasses import dataclass

from torch import Tensor


@dataclass(frozen=True)
class Reflection:
    """x -> sign · x[index], its own inverse."""

    index: Tensor
    """[d] int64."""
    sign: Tensor
    """[d] of 1 and −1."""

    def __call__(self, x: Tensor) -> Tensor:
        """The images of vectors [..., d]."""
        return x[..., self.index] * self.sign.to(x.dtype)


@dataclass(frozen=True)
class Symmetry:
    """What left and right are to a policy: the mirrored observation calls for the mirrored
    action."""

    observation: Reflection
    """Of the state followed by the goal."""
    action: Reflection
