"""Our loop over Ray actors trains as the local runner does."""

from dataclasses import replace

from console.bench.peers import fleet, ours
from console.bench.peers.protocol import Assignment
from console.run.experiment import PRESETS


def test_an_iteration_over_ray_has_the_batch_of_one_here() -> None:
    preset = PRESETS["fast"]
    small = replace(
        preset,
        scenes=64,
        block=32,
        horizon=4,
        world=replace(preset.world, pieces=2, scales=1),
        ppo=replace(preset.ppo, hidden=(16, 16), task_weight=1.0, style_weight=0.0),
    )
    for adapter in (fleet, ours):
        with adapter.open_peer(Assignment(small, 2)) as iterate:
            assert [iterate(), iterate()] == [256, 256]
