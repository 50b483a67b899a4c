"""The simulators that step a shard's scenes, by name."""

import torch

from world.device import CPU
from world.errors import ChoiceError, ConfigError
from world.scene.batch import ModelBank, Scenes
from world.scene.warp_config import DEFAULT, WarpConfig

NAMES = ("mujoco", "warp")
EXTRA = "pip install 'inhabit[warp]'"


def make(
    name: str,
    bank: ModelBank,
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


def each(name: str, bank: ModelBank, action_scale: float, action_clip: float) -> Scenes:
    """A scene with each of a bank's variants, on the CPU."""
    if name == "mujoco":
        return Scenes(bank.models, action_scale, action_clip)
    n = len(bank.models)
    scenes = make(name, bank, n, action_scale, action_clip)
    scenes.choose(torch.arange(n), bank, torch.arange(n))
    return scenes


def require_warp() -> None:
    """Raise ConfigError, naming the extra, where mujoco-warp cannot be imported."""
    try:
        import warp

        warp.config.log_level = warp.LOG_WARNING  # else a line for every kernel
        import mujoco_warp  # noqa: F401
    except ImportError as error:
        raise ConfigError(
            f"--simulator warp: mujoco-warp is not installed ({error}): {EXTRA}"
        ) from error
