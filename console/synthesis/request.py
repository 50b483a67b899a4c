"""What the flags of `inhabit synthesize` say of a scene: a request, and a piece that it cannot
name."""

import difflib
import math
from pathlib import Path

import numpy as np

from console.commands import Synthesize
from console.synthesis.motion import MOST_S
from policy.synthesis.box import MASSES_KG, SIZES_M
from policy.synthesis.placement import SCALES
from rpc.v1 import policy_pb2 as pb
from world.character import model as character
from world.errors import ConfigError, InhabitError, PieceError
from world.furniture import catalogue
from world.furniture.bands import SPLITS
from world.furniture.piece import Piece
from world.meshes import importing, source, store
from world.meshes.build import Told
from world.objects.targets import spots
from world.scene import box as box_scene
from world.tasks import Task

BOX = "box"
#: Farthest from the origin that anything is put, m, and the heights of stands, m.
_FAR_M, _STANDS_M = 1000.0, (0.05, 3.0)
_NEAREST = 3


def scene(
    command: Synthesize, task: Task, seed: int | None
) -> tuple[pb.SynthesizeRequest, Piece | None]:
    """The request of a command for a policy of `task`, and its furniture at its scale (None: a
    box).

    seed: of the actions; None: their means. Raises ConfigError, which names the flag, and
    PieceError for a piece that cannot be used.
    """
    seconds = within("--seconds", command.seconds, (1.0 / character.CONTROL_HZ, MOST_S))
    x, y, yaw = numbers("--start", command.start, "X,Y,YAW (m, m, degrees)")
    request = pb.SynthesizeRequest(
        task=task.name, seconds=seconds, seed=seed, to_the_end=command.to_the_end
    )
    request.start.standing.CopyFrom(pb.Stance(x=x, y=y, yaw_rad=math.radians(yaw)))
    of_perturbation = command.seed or 0
    if command.perturb == "projectiles":
        request.projectiles.CopyFrom(pb.Projectiles(seed=of_perturbation))
    if command.perturb == "moved":
        request.displacement.CopyFrom(pb.Displacement(seed=of_perturbation))
    if task.affordance == "carry":
        request.box.CopyFrom(box_of(command))
        return request, None
    if command.to is not None or command.box_kg is not None:
        raise ConfigError(
            f"--to and --box-kg are of a box to carry; this policy's task: {task.name}"
        )
    scale = within("--scale", command.scale, SCALES)
    piece = piece_of(command.object).scaled(scale)
    places = len(spots(piece, task.affordance))
    if not 0 <= command.place < places:
        raise ConfigError(f"--place {command.place}: {piece.name} has {places}, counted from 0")
    x, y, yaw = numbers("--at", command.at, "X,Y,YAW (m, m, degrees)")
    half = 0.5 * math.radians(yaw)
    request.furniture.CopyFrom(
        pb.Furniture(
            position=[x, y, 0.0],
            rotation=[math.cos(half), 0.0, 0.0, math.sin(half)],
            scale=scale,
            place=command.place,
        )
    )
    return request, piece


def box_of(command: Synthesize) -> pb.CarriedBox:
    """The box of a command on its stand, and where it should go."""
    if command.object != BOX:
        raise ConfigError(f"--object {command.object}: this policy carries; give --object {BOX}")
    if command.to is None:
        raise ConfigError("--to X,Y,HEIGHT: say where the box should go (m; the stand's top)")
    size = command.scale * np.array(box_scene.BOX_SIZE_M)
    smallest, largest = SIZES_M[0] / size.min(), SIZES_M[1] / size.max()
    within("--scale", command.scale, (smallest * command.scale, largest * command.scale))
    x, y, yaw = numbers("--at", command.at, "X,Y,YAW (m, m, degrees)")
    to_x, to_y, height = numbers("--to", command.to, "X,Y,HEIGHT (m)")
    up = 0.5 * float(size[2])
    start = [x, y, within("--stand-m", command.stand_m, _STANDS_M) + up]
    half = 0.5 * math.radians(yaw)
    found = pb.CarriedBox(
        position=start,
        rotation=[math.cos(half), 0.0, 0.0, math.sin(half)],
        velocity=[0.0, 0.0, 0.0],
        size=size.tolist(),
        start=start,
        goal=[to_x, to_y, within("--to's HEIGHT", height, _STANDS_M) + up],
    )
    if command.box_kg is not None:
        found.mass_kg = within("--box-kg", command.box_kg, MASSES_KG)
    return found


def piece_of(word: str) -> Piece:
    """The furniture that a word means: a piece of the catalogue by name, the file of an imported
    one, or a mesh, made a piece here and now.

    Raises ConfigError with the nearest names for a name that is none, PieceError for a file that
    gives no piece.
    """
    path = Path(word)
    if word.endswith(store.SUFFIX):
        return store.read(path)
    if path.suffix.lower() in source.SUFFIXES:
        return _made(path)
    try:
        return catalogue.find(word)
    except InhabitError:
        if path.exists():
            raise PieceError(
                f"--object {word}: no piece; give a {store.SUFFIX} of inhabit objects import, or a "
                f"mesh ({', '.join(source.SUFFIXES)})"
            ) from None
        raise ConfigError(
            f"--object {word}: no such piece; the nearest names are {', '.join(nearest(word))} (or "
            f"give a {store.SUFFIX} or a mesh)"
        ) from None


def nearest(word: str) -> list[str]:
    """The names of the catalogue that a word is nearest to."""
    names = [
        f"{category}-{split}-{index:03d}"
        for category in catalogue.REGISTRY
        for split in SPLITS
        for index in range(catalogue.WHOLE[split] // len(catalogue.REGISTRY))
    ]
    return difflib.get_close_matches(word, names, _NEAREST, 0.0)


def _made(path: Path) -> Piece:
    work = importing.jobs([path], Told())
    (outcome,) = importing.run(work, 1)
    piece = outcome.piece()
    if piece is None:
        raise PieceError(f"--object {path}: {outcome.refused}")
    return piece


def numbers(flag: str, text: str, form: str) -> tuple[float, float, float]:
    """Three numbers, commas between them; ConfigError names the flag and the form."""
    try:
        a, b, c = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(f"{flag} {text}: give {form}") from None
    if not all(abs(value) <= _FAR_M for value in (a, b, c)):
        raise ConfigError(f"{flag} {text}: each number must be within ±{_FAR_M:g}")
    return a, b, c


def within(flag: str, value: float, bounds: tuple[float, float]) -> float:
    """The value of a flag, or ConfigError beyond its bounds."""
    low, high = bounds
    if not low <= value <= high:
        raise ConfigError(f"{flag} {value:g}: choose {low:.3g} to {high:.3g}")
    return value
