"""The number format in which networks compute on a device, with the reason."""

import contextlib
from dataclasses import dataclass
from pathlib import Path

import torch

# Instructions that multiply bf16 natively. Without them oneDNN emulates bf16, which is measured ten
# to thirty times slower than float32 on a processor with AVX2 only.
CPU_BF16_FLAGS = ("avx512_bf16", "amx_bf16")


@dataclass(frozen=True)
class Precision:
    """The number format of one device; `reason` is the sentence that `doctor` and the log show."""

    device: str
    autocast: torch.dtype | None
    reason: str

    def context(self) -> contextlib.AbstractContextManager[object]:
        """Autocast for a forward pass of a network's body, or nothing in float32."""
        if self.autocast is None:
            return contextlib.nullcontext()
        return torch.autocast(self.device, dtype=self.autocast, cache_enabled=False)


#: Serving and evaluation: the same on every machine, and small batches gain nothing from bf16.
FLOAT32 = Precision("cpu", None, "float32: as on every machine")


def cpu_flags(cpuinfo: Path = Path("/proc/cpuinfo")) -> frozenset[str]:
    """Instruction sets of this processor; empty where the system does not list them."""
    try:
        for line in cpuinfo.read_text().splitlines():
            if line.startswith(("flags", "Features")):
                return frozenset(line.partition(":")[2].split())
    except OSError:
        pass
    return frozenset()


def decide(device: str = "cpu", flags: frozenset[str] | None = None) -> Precision:
    """bf16 autocast where the hardware multiplies it natively, float32 elsewhere."""
    kind = torch.device(device).type
    if kind == "cuda":
        return Precision(kind, torch.bfloat16, "bf16 autocast: the GPU multiplies bf16 natively")
    if kind != "cpu":
        return Precision(kind, None, f"float32: bf16 was never measured on '{kind}'")
    found = [flag for flag in CPU_BF16_FLAGS if flag in (cpu_flags() if flags is None else flags)]
    if found:
        return Precision(kind, torch.bfloat16, f"bf16 autocast: this processor has {found[0]}")
    missing = " nor ".join(CPU_BF16_FLAGS)
    return Precision(kind, None, f"float32: this processor has neither {missing}")
