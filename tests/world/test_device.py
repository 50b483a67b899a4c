"""The device seam: what it hands back on the CPU, what it refuses, and what it moves."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest
import torch

from tests.support.stand_in_gpu import GPU, StandInError, There, stand_in_gpu
from world import device as devices
from world import random_streams
from world.character import features, servos
from world.character.model import standing_qpos
from world.device import CPU, DeviceError, at, moved, put, resolve
from world.errors import ConfigError
from world.scene import simulators


@dataclass(frozen=True)
class Held:
    """Tensors at several depths."""

    one: torch.Tensor
    many: tuple[torch.Tensor, ...]
    named: dict[str, torch.Tensor]
    text: str = "as it is"


def test_names() -> None:
    assert resolve("cpu").torch == CPU
    with pytest.raises(ConfigError, match="--device tpu: choose one of auto, cpu, cuda"):
        resolve("tpu")
    auto = resolve("auto")
    assert auto.torch.type == ("cuda" if torch.cuda.is_available() else "cpu")


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("The NVIDIA driver on your system is too old (found version 11040).", "too old for CUDA"),
        ("Found no NVIDIA driver on your system. Please check", "no usable NVIDIA GPU"),
    ],
)
def test_a_gpu_that_cannot_be_had_is_one_line(
    fault: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def init() -> None:
        raise RuntimeError(fault)

    monkeypatch.setattr(torch.version, "cuda", "13.0")
    monkeypatch.setattr(torch.cuda, "init", init)
    with pytest.raises(DeviceError, match=said) as refused:
        resolve("cuda")
    assert "\n" not in str(refused.value) and "--device cpu" in str(refused.value)
    assert resolve("auto").torch == CPU and said in resolve("auto").reason


def test_a_torch_without_cuda_and_a_machine_without_gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.version, "cuda", None)
    with pytest.raises(DeviceError, match="built for CPUs alone"):
        resolve("cuda")
    monkeypatch.setattr(torch.version, "cuda", "13.0")
    monkeypatch.setattr(torch.cuda, "init", lambda: None)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 0)
    with pytest.raises(DeviceError, match="no NVIDIA GPU is visible"):
        resolve("cuda")


def test_a_gpu_that_is_there_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "_missing", lambda: None)
    found = SimpleNamespace(name="Some GPU", total_memory=80e9)
    monkeypatch.setattr(torch.cuda, "get_device_properties", lambda _: found)
    before = torch.get_float32_matmul_precision()
    try:
        assert resolve("auto").torch == torch.device("cuda", 0)
        assert resolve("cuda").reason == "networks on Some GPU, 80 GB"
    finally:
        torch.set_float32_matmul_precision(before)


def test_on_the_cpu_everything_is_itself() -> None:
    tensor = torch.arange(3.0)
    held = Held(tensor, (tensor,), {"a": tensor})
    assert put(tensor, CPU) is tensor and at(tensor, tensor) is tensor
    assert moved(held, CPU) is held


def test_moved_reaches_every_depth_and_leaves_the_original() -> None:
    tensor = torch.arange(3.0)
    held = Held(tensor, (tensor, tensor + 1), {"a": tensor})
    with stand_in_gpu() as gpu:
        there = moved(held, gpu)
        assert isinstance(there.one, There) and isinstance(there.many[1], There)
        assert isinstance(there.named["a"], There) and there.text == "as it is"
        assert torch.equal(there.many[1].cpu(), tensor + 1)
        assert at(tensor, there.one) is at(tensor, there.one)
    assert held.one is tensor and not isinstance(held.many[0], There)


def test_the_stand_in_refuses_what_a_gpu_would() -> None:
    here = torch.arange(3.0)
    with stand_in_gpu() as gpu:
        there = here.to(gpu)
        assert float((there + 1.0).sum()) == 6.0
        assert torch.equal((there * torch.tensor(2.0)).cpu(), 2 * here)
        with pytest.raises(StandInError):
            there + here
        with pytest.raises(StandInError):
            there.numpy()


def test_features_set_points_and_streams_are_the_cpus_on_any_device() -> None:
    draw = torch.Generator().manual_seed(0)
    qpos = torch.from_numpy(standing_qpos()).float().expand(5, -1).clone()
    qpos[:, 7:] += 0.1 * torch.randn(5, 36, generator=draw)
    qvel = torch.randn(5, 34, generator=draw)
    targets = torch.randn(5, 28, generator=draw).double()
    ids = torch.arange(5)
    wanted = features.body(qpos, qvel)
    limited = servos.limited(targets, qpos.double(), qvel.double())
    noise = random_streams.normal(3, ids, 9, 28)
    with stand_in_gpu() as gpu:
        found = features.body(qpos.to(gpu), qvel.to(gpu))
        assert torch.equal(found.features.cpu(), wanted.features)
        assert torch.equal(found.head.cpu(), wanted.head)
        there = servos.limited(targets.to(gpu), qpos.double().to(gpu), qvel.double().to(gpu))
        assert torch.equal(there.cpu(), limited)
        assert torch.equal(random_streams.normal(3, ids.to(gpu), 9, 28).cpu(), noise)


def test_memory_that_runs_out_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    gpu = torch.device("cuda", 0)
    for error in (
        torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2 GiB"),
        RuntimeError("Failed to allocate 12 bytes on device 'cuda:0'"),
    ):
        with (
            pytest.raises(DeviceError, match=r"--scenes 4096: .* try --scenes 2048"),
            devices.memory_refusals(gpu, 4096, 64),
        ):
            raise error
    with pytest.raises(RuntimeError, match="another"), devices.memory_refusals(gpu, 64, 64):
        raise RuntimeError("another fault")
    with pytest.raises(RuntimeError, match="out of memory"), devices.memory_refusals(CPU, 64, 64):
        raise RuntimeError("out of memory")


def test_simulators_refuse_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    bank = SimpleNamespace(models=[], pieces=[])
    with pytest.raises(ConfigError, match="mujoco steps on the CPU: choose --simulator warp"):
        simulators.make("mujoco", bank, 1, 0.3, 3.0, GPU)
    with pytest.raises(Exception, match="choose one of mujoco, warp"):
        simulators.make("bullet", bank, 1, 0.3, 3.0)
    monkeypatch.setitem(__import__("sys").modules, "mujoco_warp", None)
    with pytest.raises(ConfigError, match=r"not installed.*inhabit\[warp\]"):
        simulators.make("warp", bank, 1, 0.3, 3.0)
