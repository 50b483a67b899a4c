"""Records the scripted porter (world.teachers.carry) as motion clips with a box: training on carry
can then start at any moment of them, and learn their style. They are nobody's recording: no data's
licence.

python -m examples.record_porter runs/porter --clips 200
inhabit train carry --init runs/taught --motions runs/porter
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import tyro

from examples.school import School, Settings
from world import rotations
from world.character import kinematics
from world.character import model as character
from world.config import WorldConfig
from world.motions import clip_file
from world.motions.clip import Clip, validate
from world.motions.objects import BoxTrack
from world.tasks.carry import Carry, grips
from world.teachers.motion import HANDS

#: What comes so many control steps before a fall is left out; a clip has at least so many.
_BEFORE_FALL, _SHORTEST = 60, 90
#: Off its stand by this, m, a box between the hands is carried.
_OFF_M = 0.03


@dataclass(frozen=True)
class Recording:
    """What is recorded."""

    out: tyro.conf.Positional[Path]
    """Folder to write the clips to."""
    clips: int = 200
    """How many."""
    scenes: int = 128
    """Scenes at once."""
    seed: int = 0
    """Of the boxes and where they stand."""


class Recorder:
    """Runs scenes and cuts them into clips."""

    def __init__(self, settings: Recording) -> None:
        world = WorldConfig(task="carry", episode_s=Carry.episode_s)
        lessons = Settings(settings.out, scenes=settings.scenes, seed=settings.seed, in_hand=0.0)
        self._school, self._out = School(lessons, world), settings.out
        n = settings.scenes
        self._frames: list[list[tuple[np.ndarray, np.ndarray, bool]]] = [[] for _ in range(n)]
        self._across = torch.zeros(n)
        self.written = 0

    def step(self) -> None:
        """One control step of all scenes; episodes that end become clips."""
        school = self._school
        now, body = school.scenes.now(school.place), school.scenes.body()
        box = now.box
        assert box is not None
        offset = (body.position[:, HANDS[0]] - body.position[:, HANDS[1]])[:, None]
        along = (offset * rotations.matrix(box.rotation).transpose(1, 2)).sum(dim=2).abs()
        off = (box.position - box.start).norm(dim=1) > _OFF_M
        held = (grips(body, box) & off).numpy()
        pose = torch.cat((box.position, box.rotation), dim=1).float().numpy()
        self._across = torch.where(torch.from_numpy(held), along[:, 1] - along[:, 0], self._across)
        qpos = school.scenes.qpos.float().numpy().copy()
        for row, frames in enumerate(self._frames):
            frames.append((qpos[row], pose[row], bool(held[row])))
        fell, over = school.drive()
        for row in over.nonzero().flatten().tolist():
            frames, self._frames[row] = self._frames[row], []
            self._cut(frames[: len(frames) - _BEFORE_FALL] if fell[row] else frames, row)
        school.again(over)

    def _cut(self, frames: list[tuple[np.ndarray, np.ndarray, bool]], row: int) -> None:
        held = np.array([h for _, _, h in frames], dtype=bool)
        # clips have boxes by their width, across which they are held
        if len(frames) < _SHORTEST or not held.any() or self._across[row] < 0.0:
            return
        # held from the first touch to the last: fingers that slip for a moment let nothing go
        first, last = np.flatnonzero(held)[[0, -1]]
        held[first : last + 1] = True
        qpos = torch.from_numpy(np.stack([q for q, _, _ in frames]))
        rotation = kinematics.local_rotations(qpos).numpy()
        half = self._school.bank.half[row]
        x, y, z = (2.0 * half).tolist()
        track = BoxTrack(np.stack([p for _, p, _ in frames]), (x, y, z), held)
        clip = Clip(
            f"porter_{self.written:04d}",
            character.CONTROL_HZ,
            qpos[:, :3].numpy(),
            rotation,
            "world.teachers.carry",
            "Apache-2.0",
            box=track,
        )
        clip_file.write(self._out / f"{clip.name}.npz", validate(clip))
        self.written += 1


def record(settings: Recording) -> None:
    """Until there are enough clips."""
    recorder = Recorder(settings)
    while recorder.written < settings.clips:
        recorder.step()
    print(f"{recorder.written} clips in {settings.out}")


if __name__ == "__main__":
    torch.set_num_threads(1)
    record(tyro.cli(Recording, description=__doc__))
