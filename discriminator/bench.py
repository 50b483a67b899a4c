"""What the wire costs: the same rollouts scored in process and over gRPC, by turns."""

import statistics
import time

import torch
from torch import Tensor

from discriminator.client import StyleClient
from discriminator.process import ServiceSpec, build, start_process
from rpc.channel import ChannelConfig


def measure_transport(
    spec: ServiceSpec, scenes: int = 512, steps: int = 8, rounds: int = 20
) -> dict[str, float]:
    """Medians over `rounds` rollouts of [steps, scenes]; every key ends in its unit.

    `transport_ms` is what an iteration pays for the service: scoring and training over gRPC
    less the same in process. Raises StyleError if the service cannot start.
    """
    style, _ = build(spec)
    process = start_process(spec)
    client = StyleClient(ChannelConfig(process.address))
    figures: dict[str, list[float]] = {}
    try:
        for batch in range(rounds):
            rollout = _rollout(batch, steps, scenes, style.width)
            for place, one in (("local", style), ("rpc", client)):
                began = time.perf_counter()
                one.score(batch, **rollout)
                scored = time.perf_counter()
                one.train(batch)
                trained = time.perf_counter()
                figures.setdefault(f"score_{place}_ms", []).append(1e3 * (scored - began))
                figures.setdefault(f"train_{place}_ms", []).append(1e3 * (trained - scored))
    finally:
        client.close()
        process.stop()
    medians = {name: statistics.median(values) for name, values in figures.items()}
    apart = [
        figures["score_rpc_ms"][i]
        + figures["train_rpc_ms"][i]
        - figures["score_local_ms"][i]
        - figures["train_local_ms"][i]
        for i in range(rounds)
    ]
    medians["transport_ms"] = statistics.median(apart)
    medians["score_local_us_per_sample"] = 1e3 * medians["score_local_ms"] / (steps * scenes)
    return medians


def _rollout(seed: int, steps: int, scenes: int, width: int) -> dict[str, Tensor]:
    draw = torch.Generator().manual_seed(seed)
    return {
        "rollout_states": torch.randn(steps + 1, scenes, width, generator=draw),
        "end_index": torch.tensor([[0, 0]]),
        "end_states": torch.randn(1, width, generator=draw),
        "valid": torch.ones(steps, scenes, dtype=torch.bool),
    }
