"""The peers of `inhabit bench peers` and `learning`: packages, versions, and what they compute."""

from dataclasses import dataclass
from pathlib import Path

EXTRA = "pip install 'inhabit[peers]'"
#: Ours, whole and without the style reward, in the order in which they take turns.
OURS, OURS_TASK = "inhabit", "inhabit_task"
#: Ours in `bench learning`, with the learning rate of the others.
OURS_EQUAL = "inhabit_equal"
#: The scenes alone, without learning: what no library can exceed on them.
SCENES = "scenes"


@dataclass(frozen=True)
class Peer:
    """A library that trains on the same scenes."""

    name: str
    """Its name in figures and in `--peer-python`; its adapter is `console.bench.peers.NAME`."""
    title: str
    """Its name as its authors write it."""
    distribution: str
    """The package that is installed."""
    requirement: str
    """What the extra `peers` names."""
    version: str
    """The version that is measured; others are measured and named."""
    bf16: str
    """Where it computes in bf16 on a processor that multiplies it natively; empty: nowhere."""
    normaliser: str
    """What normalises observations; empty: nothing."""
    scenes: str
    """How it steps the scenes."""


_WORKERS = "one process a core, the learner waits"
PEERS = (
    Peer("rsl_rl", "rsl_rl", "rsl-rl-lib", "rsl-rl-lib", "5.5.1",
         "its option `use_mixed_precision`: the update", "its `EmpiricalNormalization`", _WORKERS),
    Peer("skrl", "skrl", "skrl", "skrl", "2.1.1",
         "its option `mixed_precision`: acting and the update", "its `RunningStandardScaler`",
         _WORKERS),
    Peer("torchrl", "TorchRL", "torchrl", "torchrl", "0.14.1",
         "autocast around the loss, in the adapter's loop", "its `VecNormV2`", _WORKERS),
    Peer("rllib", "RLlib", "ray", "ray[rllib]", "2.60.0", "", "",
         "its own environment runners, one process a core"),
)  # fmt: skip
NAMES = tuple(peer.name for peer in PEERS)


def by_name(name: str) -> Peer:
    """Return a peer by its name."""
    return next(peer for peer in PEERS if peer.name == name)


def adapter(name: str) -> Path:
    """Return the file of a peer's adapter."""
    return Path(__file__).with_name(f"{name}.py")
