"""The device that networks and scenes live on; every line that only a GPU needs is in this module
and in world.graphs.

Everything above it is torch that follows its inputs: on the CPU each function here hands back what
it was given, so that the numbers there do not depend on this module.
"""

import contextlib
import copy
import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import torch
from torch import Tensor

from world import vector_math  # noqa: F401  # pyright: ignore[reportUnusedImport]
from world.errors import ConfigError, InhabitError

CHOICES = ("auto", "cpu", "cuda")
CPU = torch.device("cpu")
_CPU_LINE = "use --device cpu"

Thing = TypeVar("Thing")


class DeviceError(InhabitError):
    """A device that is not there, cannot be used, or is too small."""


@dataclass(frozen=True)
class Device:
    """A device and the sentence on it that the log and `doctor` show."""

    torch: torch.device
    reason: str


def resolve(name: str = "auto") -> Device:
    """The device that --device names; `auto` takes a GPU that can be used.

    Raises DeviceError with one line where --device cuda cannot be had, ConfigError for other names.
    """
    if name not in CHOICES:
        raise ConfigError(f"--device {name}: choose one of {', '.join(CHOICES)}")
    if name == "cpu":
        return Device(CPU, "networks on the CPU")
    missing = _missing()
    if missing is None:
        found = torch.cuda.get_device_properties(0)
        memory = found.total_memory / 1e9
        torch.set_float32_matmul_precision("high")  # TF32 where autocast leaves float32
        return Device(torch.device("cuda", 0), f"networks on {found.name}, {memory:.0f} GB")
    if name == "cuda":
        raise DeviceError(f"--device cuda: {missing}; {_CPU_LINE}")
    return Device(CPU, f"networks on the CPU: {missing}")


def _missing() -> str | None:
    """Why there is no GPU to use; None where there is one."""
    if torch.version.cuda is None:
        return f"this torch ({torch.__version__}) is built for CPUs alone: install one with CUDA"
    try:
        torch.cuda.init()
    except (RuntimeError, AssertionError) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        if "driver" in first.lower() and "old" in first.lower():
            return (
                f"the NVIDIA driver is too old for CUDA {torch.version.cuda}: update it, or install"
                " a torch built for an older CUDA"
            )
        return f"no usable NVIDIA GPU ({first.rstrip('.')})"
    return None if torch.cuda.device_count() else "no NVIDIA GPU is visible"


def put(tensor: Tensor, device: torch.device) -> Tensor:
    """The tensor on `device`; itself where it is there already.

    From the CPU to a GPU it goes through pinned memory, on a stream of its own, so that the copy
    waits for no kernel that is queued; torch keeps the pinned blocks for the next time.
    """
    if tensor.device == device:
        return tensor
    if tensor.device.type == "cpu" and device.type == "cuda":
        return _upload(tensor, device)
    return tensor.to(device)


_copies: dict[torch.device, Any] = {}


def _upload(tensor: Tensor, device: torch.device) -> Tensor:
    if device not in _copies:
        _copies[device] = torch.cuda.Stream(device)
    with torch.cuda.stream(_copies[device]):
        there = tensor.pin_memory().to(device, non_blocking=True)
    current = torch.cuda.current_stream(device)
    current.wait_stream(_copies[device])
    there.record_stream(current)
    return there


#: Rows of an inference on a GPU: enough to fill it, and its activations in a few hundred megabytes.
_GPU_ROWS = 65_536


def block_rows(on_cpu: int, device: torch.device) -> int:
    """Rows of an inference at a time: `on_cpu`, or on a GPU as many as it likes."""
    return _GPU_ROWS if device.type == "cuda" else on_cpu


_constants: dict[tuple[int, torch.device], tuple[Tensor, Tensor]] = {}


def at(constant: Tensor, like: Tensor | torch.device) -> Tensor:
    """A module's constant on the device of `like`; moved there once in a process."""
    device = like if isinstance(like, torch.device) else like.device
    if device.type == "cpu":
        return constant
    key = id(constant), device
    if key not in _constants:
        # the constant itself is kept too, so that its id stays its own
        _constants[key] = constant, constant.to(device)
    return _constants[key][1]


def moved(thing: Thing, device: torch.device) -> Thing:
    """A copy of an object with all tensors that it holds on `device`, through its dataclasses,
    tuples, lists and dicts and the project's own objects; itself on the CPU."""
    return thing if device.type == "cpu" else _moved(thing, device, {})


def _moved(thing: Any, device: torch.device, done: dict[int, Any]) -> Any:
    if isinstance(thing, Tensor):
        return put(thing, device)
    if id(thing) in done:
        return done[id(thing)][1]
    if isinstance(thing, tuple | list) and not hasattr(thing, "_fields"):
        found: Any = type(thing)(_moved(item, device, done) for item in thing)
    elif isinstance(thing, dict):
        found = {key: _moved(item, device, done) for key, item in thing.items()}
    elif _is_ours(thing):
        found = copy.copy(thing)
        done[id(thing)] = thing, found
        for name, value in vars(thing).items():
            object.__setattr__(found, name, _moved(value, device, done))
    else:
        found = thing
    done[id(thing)] = thing, found
    return found


def _is_ours(thing: Any) -> bool:
    """An instance of one of the project's classes that has attributes."""
    room = type(thing).__module__.partition(".")[0]
    known = dataclasses.is_dataclass(thing) or room in {"world", "policy", "discriminator"}
    return known and not isinstance(thing, type) and hasattr(thing, "__dict__")


def memory_free(device: torch.device) -> int | None:
    """Bytes that can still be had on a GPU; None for the CPU, whose memory the system lends."""
    if device.type != "cuda":
        return None
    free, _ = torch.cuda.mem_get_info(device)
    return free


def fitting(scenes: int, block: int, per_scene: float, free: float) -> int:
    """How many scenes, in whole blocks and no more than `scenes`, take at most `free` bytes at
    `per_scene` bytes each."""
    return min(scenes, int(free / max(per_scene, 1.0)) // block * block)


def require_memory(scenes: int, block: int, per_scene: float, free: int | None) -> None:
    """Raise DeviceError, with how many scenes fit, where so many take more than `free` bytes (None:
    no bound)."""
    if free is None or scenes * per_scene <= free:
        return
    fit = fitting(scenes, block, per_scene, free)
    advice = f"at most {fit} fit: --scenes {fit}" if fit else f"not even a block of {block} fits"
    raise DeviceError(
        f"--scenes {scenes} takes {scenes * per_scene / 1e9:.1f} GB on the GPU,"
        f" {free / 1e9:.1f} GB are free: {advice}"
    )


@contextlib.contextmanager
def memory_refusals(device: torch.device, scenes: int, block: int) -> Iterator[None]:
    """Within it, running out of a GPU's memory becomes one DeviceError that says what to
    lower; `require_memory` says before how many scenes fit."""
    try:
        yield
    except RuntimeError as error:
        if device.type == "cpu" or not is_out_of_memory(error):
            raise
        raise out_of_memory(scenes, block) from error


def is_out_of_memory(error: BaseException) -> bool:
    """Whether it is torch's or Warp's word for a device whose memory is used up."""
    text = str(error).lower()
    wanted = ("out of memory", "failed to allocate")
    return isinstance(error, torch.OutOfMemoryError) or any(words in text for words in wanted)


def out_of_memory(scenes: int, block: int) -> DeviceError:
    """What is said where so many scenes, in blocks, ran out of it all the same."""
    half = max(block, scenes // 2 // block * block)
    return DeviceError(
        f"--scenes {scenes}: the GPU's memory is used up: try --scenes {half}, or a smaller"
        " --ppo.minibatch; other programs may hold some of it"
    )


def synchronise(device: torch.device) -> None:
    """Wait for what is queued on a GPU, so that a clock may be read."""
    if device.type == "cuda":
        torch.cuda.synchronize(device)


def memory_used(device: torch.device) -> int:
    """Bytes in use on a GPU, by whatever; 0 for the CPU."""
    if device.type != "cuda":
        return 0
    free, total = torch.cuda.mem_get_info(device)
    return total - free
