"""Characters that walk as commanded, and the feet and boxes of hand-made scenes."""

import torch
from torch import Tensor

from world import rotations
from world.character import model as character
from world.scene.batch import Scenes
from world.scene.model import compile_scene
from world.scene.target import BoxState
from world.teachers.scripted import motion as mover
from world.teachers.scripted import phase_cue
from world.teachers.scripted.gait import Footing, Gait, unit
from world.teachers.scripted.motion import Pace, Reach
from world.teachers.scripted.whole_body import Figure, Load, Mass


class Walk:
    """n characters on an empty floor that follow step commands; the hands hang."""

    def __init__(self, n: int) -> None:
        self.n, self.gait = n, Gait(n)
        self.scenes = Scenes([compile_scene(None)] * n, 0.35, 3.0)
        standing = torch.from_numpy(character.standing_qpos()).float()[None].repeat(n, 1)
        away, ahead = torch.full((n, 3), -9.0), torch.tensor([[1.0, 0.0]]).repeat(n, 1)
        self.scenes.set_state(torch.arange(n), standing, torch.zeros(n, 34), away, ahead)

    def go(
        self, command: Tensor, stop: bool, steps: int, observer: Gait | None = None
    ) -> list[Tensor]:
        """[n] bool of each step: an observing gait has the same foot in the air, less than two
        control steps earlier or later."""
        agree: list[Tensor] = []
        n, nothing = self.n, torch.zeros(self.n, 2, 3).double()
        none = torch.zeros(n, dtype=torch.bool)
        hang = Reach(
            none, none, nothing, nothing, nothing, nothing[:, 0, 0], nothing[:, 0], nothing
        )
        for _ in range(steps):
            figure = Figure.of(self.scenes.qpos, self.scenes.qvel)
            feet = Footing.of(figure)
            mass = Mass.of(figure, Load(torch.zeros(n), nothing[:, 0]))
            stride = self.gait.advance(feet, mass, command.double(), torch.full((n,), stop))
            if observer is not None:
                observer.advance(feet, mass, command.double(), torch.full((n,), stop))
                same = (observer.swing == self.gait.swing) & (observer.mode == self.gait.mode)
                agree.append(same & ((observer.time - self.gait.time).abs() < 2.0))
            cue = phase_cue.pose(self.gait, command.double())
            pace = Pace(torch.full((n,), 0.8).double(), figure.velocity[:, :2], cue)
            self.scenes.drive(mover.move(figure, feet, mass, stride, hang, pace))
        return agree

    @property
    def feet(self) -> Footing:
        return Footing.of(Figure.of(self.scenes.qpos, self.scenes.qvel))

    @property
    def yaw_rad(self) -> Tensor:
        heading = self.feet.heading
        return torch.atan2(heading[:, 1], heading[:, 0])


def bent(*angles: tuple[float, float, float]) -> Tensor:
    """[n, 43]: standing with the neck turned about x, y and z, rad."""
    qpos = torch.from_numpy(character.standing_qpos()).float()[None].repeat(len(angles), 1)
    joint = character.BALL_QPOS[1]
    qpos[:, joint : joint + 4] = rotations.from_rotation_vector(torch.tensor(angles))
    return qpos


def feet_at(x: float, y: float, yaw_rad: float) -> Footing:
    """Feet side by side about this point."""
    heading = unit(torch.tensor([yaw_rad], dtype=torch.float64))
    middle = torch.tensor([[x, y]]).double() + 0.035 * heading
    aside = 0.1 * torch.stack((-heading[:, 1], heading[:, 0]), dim=1)
    soles = torch.stack((middle - aside, middle + aside), dim=1)
    soles = torch.cat((soles, torch.zeros(1, 2, 1).double()), dim=2)
    yaw = torch.full((1, 2), yaw_rad, dtype=torch.float64)
    return Footing(soles, soles, yaw, heading)


def box_at(at: tuple[float, float], target: tuple[float, float]) -> BoxState:
    """The default box, its short edges along x, on a stand of 60 cm."""
    still, level = torch.zeros(1, 3).double(), torch.tensor([[1.0, 0.0, 0.0, 0.0]]).double()
    half = torch.tensor([[0.175, 0.25, 0.15]]).double()
    place, end = (torch.tensor([[x, y, 0.75]]).double() for x, y in (at, target))
    return BoxState(place, level, still, half, place, end)
