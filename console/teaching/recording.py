"""`inhabit teach record`: motion clips with a box, of the scripted teacher.

Their frames serve carry as reference states, and their style trains the discriminator. They
contain no recording of a person.
"""

import time

import numpy as np
import torch

from console.commands.teaching import Practice, TeachRecord
from console.teaching.scenes import TeachingScenes
from console.terminal import counted
from world import rotations
from world.character import kinematics
from world.character import model as character
from world.config import WorldConfig
from world.motions import clip_file
from world.motions.clip import Clip, validate
from world.motions.objects import BoxTrack
from world.tasks.carry import Carry, grips
from world.teachers.scripted.motion import HANDS

#: Last control steps before a fall, which are left out; fewest control steps of a clip.
_BEFORE_FALL, _SHORTEST = 60, 90
#: Distance from its initial position beyond which a box between the hands counts as held, m.
_OFF_M = 0.03
#: Seconds between two lines of progress.
_REPORT_S = 2.0


class Recorder:
    """Simulates scenes and cuts them into clips."""

    def __init__(self, command: TeachRecord) -> None:
        world = WorldConfig(task="carry", episode_s=Carry.episode_s)
        practice = Practice(scenes=command.scenes, seed=command.seed, in_hand=0.0)
        self._practice, self._out = TeachingScenes(practice, world), command.out
        n = command.scenes
        self._frames: list[list[tuple[np.ndarray, np.ndarray, bool]]] = [[] for _ in range(n)]
        self._across = torch.zeros(n)
        self.written = 0

    def step(self) -> None:
        """Step all scenes by one control step; ended episodes become clips."""
        practice = self._practice
        now, body = practice.scenes.now(practice.target), practice.scenes.body()
        box = now.box
        assert box is not None
        offset = (body.position[:, HANDS[0]] - body.position[:, HANDS[1]])[:, None]
        along = (offset * rotations.matrix(box.rotation).transpose(1, 2)).sum(dim=2).abs()
        off = (box.position - box.start).norm(dim=1) > _OFF_M
        held = (grips(body, box) & off).numpy()
        pose = torch.cat((box.position, box.rotation), dim=1).float().numpy()
        self._across = torch.where(torch.from_numpy(held), along[:, 1] - along[:, 0], self._across)
        qpos = practice.scenes.qpos.float().numpy().copy()
        for row, frames in enumerate(self._frames):
            frames.append((qpos[row], pose[row], bool(held[row])))
        fell, over = practice.drive()
        for row in over.nonzero().flatten().tolist():
            frames, self._frames[row] = self._frames[row], []
            self._cut(frames[: len(frames) - _BEFORE_FALL] if fell[row] else frames, row)
        practice.restart(over)

    def _cut(self, frames: list[tuple[np.ndarray, np.ndarray, bool]], row: int) -> None:
        held = np.array([h for _, _, h in frames], dtype=bool)
        # the box of a clip must be held across its width
        if len(frames) < _SHORTEST or not held.any() or self._across[row] < 0.0:
            return
        # held from the first contact to the last: a short slip is not a release
        first, last = np.flatnonzero(held)[[0, -1]]
        held[first : last + 1] = True
        qpos = torch.from_numpy(np.stack([q for q, _, _ in frames]))
        rotation = kinematics.local_rotations(qpos).numpy()
        half = self._practice.bank.half[row]
        x, y, z = (2.0 * half).tolist()
        track = BoxTrack(np.stack([p for _, p, _ in frames]), (x, y, z), held)
        clip = Clip(
            f"carry_teacher_{self.written:04d}",
            character.CONTROL_HZ,
            qpos[:, :3].numpy(),
            rotation,
            "world.teachers.scripted.carry",
            "Apache-2.0",
            box=track,
        )
        clip_file.write(self._out / f"{clip.name}.npz", validate(clip))
        self.written += 1


def record(command: TeachRecord) -> None:
    """Write the requested number of clips."""
    recorder = Recorder(command)
    print(f"recording {command.scenes} scenes", flush=True)
    reported = time.monotonic()
    while recorder.written < command.clips:
        recorder.step()
        if time.monotonic() - reported > _REPORT_S:
            reported = time.monotonic()
            print(f"{recorder.written} of {command.clips} clips", flush=True)
    print(f"{counted(recorder.written, 'clip')} in {command.out}")
