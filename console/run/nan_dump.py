"""NaN dump: a recording of the last second of a scene whose state became non-finite."""

from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from console.recording import format as recording
from console.recording.format import Recording, RecordingError, Take, boxes_of
from world.character.model import CONTROL_HZ
from world.episodes.shard import Shard, Step
from world.furniture.piece import Piece
from world.scene.box import STAND, is_box

#: Control steps kept, and greatest number of recordings of a run, over all its workers: a broken
#: run must not fill the disk.
KEPT, MOST = 30, 20


class NanDump:
    """A shard that writes `broken-SCENE-CLOCK.msgpack` to a folder for a non-finite scene."""

    def __init__(
        self, shard: Shard, scenes: Sequence[int], pieces: Sequence[Piece], folder: Path
    ) -> None:
        self._shard, self._scenes, self._pieces, self._folder = shard, scenes, pieces, folder
        self._states: deque[dict[str, Tensor]] = deque(maxlen=KEPT)
        self._full = False

    @property
    def clock(self) -> int:
        """Return the clock of the shard."""
        return self._shard.clock

    def observe(self) -> tuple[Tensor, Tensor]:
        """Return the observations of the shard."""
        return self._shard.observe()

    def update_sampling(self, published: Mapping[str, Tensor]) -> None:
        """Adapt the sampling of the shard."""
        self._shard.update_sampling(published)

    def step(self, action: Tensor) -> Step:
        """Step the shard and dump its non-finite scenes."""
        self._states.append(self._shard.state_dict())
        step = self._shard.step(action)
        if not bool(step.finite.all()):
            for scene in torch.nonzero(~step.finite).flatten().tolist():
                self._dump(scene, action[scene])
        return step

    def _dump(self, scene: int, action: Tensor) -> None:
        if self._full or len(list(self._folder.glob("broken-*.msgpack"))) >= MOST:
            return
        name = f"broken-{self._scenes[scene]}-{self.clock}.msgpack"
        meta = {
            "reason": "not finite",
            "control_hz": CONTROL_HZ,
            "scene": self._scenes[scene],
            "clock": self.clock,
            "last_action": action.tolist(),
        }
        try:
            recording.write(self._folder / name, Recording([self._take(scene)], meta))
        except RecordingError:
            self._full = True  # the disk is full: training continues without recordings

    def _take(self, scene: int) -> Take:
        """Return the scene's states of this episode, oldest first, up to the last finite one."""
        last = self._states[-1]
        frames = [s for s in self._states if s["episode"][scene] == last["episode"][scene]]

        def column(name: str) -> NDArray[np.float64]:
            return np.stack([frame[f"physics_{name}"][scene].cpu().numpy() for frame in frames])

        piece = self._pieces[int(last["variant"][scene])]
        cargo = is_box(piece)
        return Take(
            column("qpos"),
            column("qvel"),
            column("ctrl"),
            column("mocap_pos")[:, 0],
            column("mocap_quat")[:, 0],
            boxes_of(STAND if cargo else piece),
            piece.name,
            1.0,  # the boxes of the piece are scaled already
            {},
            cargo=np.array(piece.boxes[0].half_m) if cargo else np.zeros(0),
            stand=column("mocap_pos")[-1, 1] if cargo else np.zeros(0),
        )

    def state_dict(self) -> dict[str, Tensor]:
        """Return the state of the shard."""
        return self._shard.state_dict()

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore the shard; kept states are cleared, as they precede another one."""
        self._states.clear()
        self._shard.load_state_dict(state)
