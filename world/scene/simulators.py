"""The simulators that step a shard's scenes, by name."""

from collections.abc import Sequence
from typing import Protocol

import mujoco
import torch

from world.device import CPU
from world.errors import ChoiceError, ConfigError
from world.furniture.piece import Piece
from world.scene.batch import Scenes
from world.scene.warp_config import DEFAULT, WarpConfig

NAMES = ("mujoco", "warp")
EXTRA = "pip install 'inhabit[warp]'"


class Bank(Protocol):
    """Compiled scenes and the pieces in them, by variant."""

    @property
    def models(self) -> Sequence[mujoco.MjModel]: ...
    @property
    def pieces(self) -> Sequence[Piece]: ...


def make(
    name: str,
    bank: Bank,
    n: int,
    action_scale: float,
    action_clip: float,
    device: torch.device = CPU,
    warp: WarpConfig = DEFAULT,
) -> Scenes:
    """n scenes with the bank's first variant, their arrays on `device`.

    Raises ChoiceError for an unknown simulator; ConfigError where mujoco is asked for on a GPU or
    warp is not installed; PieceError or DeviceError where the scenes do not fit.
    """
    if name == "mujoco":
        if device.type != "cpu":
            raise ConfigError("--simulator mujoco steps on the CPU: choose --simulator warp")
        return Scenes([bank.models[0]] * n, action_scale, action_clip)
    if name != "warp":
        raise ChoiceError("--simulator", name, list(NAMES))
    require_warp()
    from world.scene.warp_batch import WarpScenes  # an extra of the package

    return WarpScenes(bank, n, action_scale, action_clip, device, warp)


def require_warp() -> None:
    """Raise ConfigError, naming the extra, where mujoco-warp cannot be imported."""
    try:
        import warp

        warp.config.quiet = True  # a line for every kernel that it compiles
        import mujoco_warp  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            f"--simulator warp: mujoco-warp is not installed ({error}): {EXTRA}"
        ) from error
