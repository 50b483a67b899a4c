"""Recordings, which readers of all formats return: the joints of a skeleton in the world."""

from dataclasses import dataclass, replace

import numpy as np

from world.errors import ClipError

#: Least number of frames of a motion: two, for a velocity.
FEWEST_FRAMES = 2
RATES_HZ = (1.0, 1000.0)
FARTHEST = 1e9
"""Greatest coordinate, in the file's unit: squares of more lose what a person does in float64."""


@dataclass(frozen=True)
class RecordedBox:
    """A box that was tracked with the motion, in the file's world."""

    position: np.ndarray
    """[T, 3]: its centre."""
    rotation: np.ndarray
    """[T, 3, 3]: its axes, along its edges."""
    size_m: tuple[float, float, float]
    """Lengths of its edges along its axes."""


@dataclass(frozen=True)
class Recording:
    """A motion on the recorded skeleton: T frames of J joints."""

    name: str
    fps: float
    names: tuple[str, ...]
    """Names of the J joints in the file; parents precede their children."""
    parents: tuple[int, ...]
    """Each joint's parent, −1 for the root."""
    position: np.ndarray
    """[T, J, 3] float64: joints in the file's world, unit and axes."""
    rotation: np.ndarray
    """[T, J, 3, 3]: each joint's rotation in the file's world, from its axes at the zero pose."""
    source: str
    licence: str
    dataset: str = ""
    """The data set that a catalogue beside the file names"""
    unit_m: float | None = None
    """Length unit of the file, m; None where it must be inferred."""
    likely_unit_m: float | None = None
    """Length unit that the file states and programs often write wrongly, m: it holds where it makes
    the legs a person's."""
    bones_known: bool = False
    """Whether the bones are those of a body model, in m: only the root's travel has the file's
    unit."""
    up: str | None = None
    """The file's upward axis, y or z; None where it must be inferred."""
    likely_up: str = "y"
    """The upward axis to infer unless the person stands along the other one."""
    own_body: bool = False
    """Whether the joints are the character's own bodies, of its size and with its axes."""
    fps_assumed: bool = False
    """Whether the file states no rate and its format's usual one is taken."""
    approximated: tuple[str, ...] = ()
    """Assumptions of the reader, in words."""

    box: RecordedBox | None = None
    """The tracked box, if any."""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What was assumed and corrected, in words."""
        rate = f"{self.fps:g} frames a second: the file does not say (--fps states another)"
        return (*((rate,) if self.fps_assumed else ()), *self.approximated)

    @property
    def frames(self) -> int:
        return self.position.shape[0]

    def part(self, start: int, stop: int) -> "Recording":
        """The frames from `start` to one before `stop`."""
        box = self.box
        if box is not None:
            box = replace(box, position=box.position[start:stop], rotation=box.rotation[start:stop])
        return replace(
            self,
            position=self.position[start:stop],
            rotation=self.rotation[start:stop],
            box=box,
        )


class RateMissingError(ClipError):
    """A file without a frame rate; the recording is at 1 frame a second."""

    def __init__(self, message: str, recording: Recording) -> None:
        super().__init__(f"{message}; --fps states the rate")
        self.recording = recording


def validate(recording: Recording) -> Recording:
    """Return the recording itself. Raises ClipError if it has no usable motion."""
    name = recording.name
    if recording.frames < FEWEST_FRAMES:
        raise ClipError(
            f"{name}: {recording.frames} frame(s); a transition needs at least {FEWEST_FRAMES}"
        )
    low, high = RATES_HZ
    if not low <= recording.fps <= high:
        raise ClipError(
            f"{name}: {recording.fps:g} frames a second; expected {low:g} to {high:g}; --fps states"
            " the rate"
        )
    finite = np.isfinite(recording.position).all((1, 2)) & np.isfinite(recording.rotation).all(
        (1, 2, 3)
    )
    if recording.box is not None and not (
        np.isfinite(recording.box.position).all() and np.isfinite(recording.box.rotation).all()
    ):
        raise ClipError(f"{name}: its box holds non-finite values")
    farthest = float(np.abs(np.nan_to_num(recording.position)).max())
    if farthest > FARTHEST:
        raise ClipError(f"{name}: positions up to {farthest:.3g}; at most {FARTHEST:.0e} are read")
    if not finite.all():
        raise ClipError(f"{name}: holds non-finite values, first in frame {finite.argmin()}")
    return recording


def forward(
    parents: tuple[int, ...], offset: np.ndarray, local: np.ndarray, root: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forward kinematics: positions [T, J, 3] and global rotations [T, J, 3, 3].

    Args:
        parents: each joint's parent, before its children; −1 for the root.
        offset: [J, 3] or [T, J, 3], each joint's origin in its parent's axes; the root's is unused.
        local: [T, J, 3, 3], each joint's rotation in its parent's axes.
        root: [T, 3], the root's position.
    """
    position, rotation = np.empty(local.shape[:-1]), np.empty_like(local)
    for joint, parent in enumerate(parents):
        if parent < 0:
            position[:, joint], rotation[:, joint] = root, local[:, joint]
            continue
        rotation[:, joint] = rotation[:, parent] @ local[:, joint]
        turned = rotation[:, parent] @ offset[..., joint, :, None]
        position[:, joint] = position[:, parent] + turned[..., 0]
    return position, rotation
