"""`inhabit bench furniture`: scenes with a mixture of pieces against scenes with a plain chair."""

import time
from collections.abc import Sequence

import mujoco
import numpy as np
import torch

from console.bench.turns import turns
from console.run import machine
from world import random_streams
from world.character.model import NU, NV
from world.furniture.catalogue import find
from world.furniture.piece import Piece, SeatTarget
from world.objects import seated_pose
from world.scene import slots
from world.scene.batch import Scenes
from world.scene.model import compile_scene

#: Control steps between two resets: long enough for a character to fall on a piece and lie there.
_EPISODE = 45
MEMORY_SCENES = 1024


def measure(
    pieces: Sequence[Piece], scenes: int, seconds: float, threads: int = 1
) -> dict[str, float]:
    """Return control steps/s of both, measured in turn, and memory of 1,024 scenes with the
    mixture.

    Characters are seated initially and have random actions; every scene has a piece of its own.
    """
    before = machine.resident_gb()
    began = time.perf_counter()
    shared = slots.common(pieces)
    models = [compile_scene(piece, shared=shared) for piece in pieces]
    compiled = time.perf_counter() - began
    chair = find("chair-train-000")
    # evenly over the pieces if there are fewer scenes than pieces
    every = [(i * len(pieces)) // scenes if scenes < len(pieces) else i % len(pieces)
             for i in range(scenes)]  # fmt: skip
    mixed = _Seated([pieces[i] for i in every], [models[i] for i in every], threads)
    plain = _Seated([chair] * scenes, [compile_scene(chair)] * scenes, threads)
    taken = {"mixed": 0.0, "plain": 0.0}
    steps, broken = 0, 0
    for step in turns(seconds, 2 * _EPISODE):
        for name, shard in (("mixed", mixed), ("plain", plain)):
            if step % _EPISODE == 0:
                shard.reset()
            start = time.perf_counter()
            shard.scenes.act(0.3 * random_streams.normal(0, shard.ids, step, NU))
            taken[name] += time.perf_counter() - start
            if name == "mixed":
                broken += int((~shard.scenes.finite()).sum())
        steps = step + 1
    swap = time.perf_counter()
    mixed.scenes.set_models(range(scenes), [models[(i + 1) % len(models)] for i in every])
    swap = time.perf_counter() - swap
    large = _Seated(
        [pieces[i % len(pieces)] for i in range(MEMORY_SCENES)],
        [models[i % len(models)] for i in range(MEMORY_SCENES)],
        threads,
    )
    large.reset()
    large.scenes.act(torch.zeros(MEMORY_SCENES, NU))
    return {
        "pieces_count": float(len(pieces)),
        "slots_count": float(shared.slots),
        "mixed_control_steps_per_s": steps * scenes / taken["mixed"],
        "chair_control_steps_per_s": steps * scenes / taken["plain"],
        "mixed_to_chair_time_ratio": taken["mixed"] / taken["plain"],
        "swap_ms": 1e3 * swap,
        "compile_ms_per_piece": 1e3 * compiled / len(pieces),
        "model_mb": sum(mujoco.mj_sizeModel(m) for m in models) / len(models) / 1e6,
        "memory_1024_scenes_gb": machine.resident_gb() - before,
        "broken_scenes_count": float(broken),
    }


class _Seated:
    """Scenes with characters seated on the pieces, or squatting before those without a seat."""

    def __init__(
        self, pieces: Sequence[Piece], models: Sequence[mujoco.MjModel], threads: int
    ) -> None:
        self.scenes = Scenes(models, 0.3, 3.0, threads)
        self.ids = torch.arange(len(models))
        self._qpos = torch.from_numpy(np.stack([seated_pose.qpos(_place(p)) for p in pieces]))

    def reset(self) -> None:
        n = len(self.ids)
        yaw = torch.tensor([[1.0, 0.0]]).expand(n, 2)
        self.scenes.set_state(self.ids, self._qpos, torch.zeros(n, NV), torch.zeros(n, 3), yaw)


def _place(piece: Piece) -> SeatTarget:
    return piece.sit[0] if piece.sit else SeatTarget((piece.size_m[0] / 2 + 0.3, 0.0, 0.45))
