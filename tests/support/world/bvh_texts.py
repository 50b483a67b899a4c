"""BVH text of any hierarchy and channels, with its kinematics worked out by 4 x 4 matrices."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

LETTERS = {"X": 0, "Y": 1, "Z": 2}


@dataclass
class Node:
    """A joint: its channels are words such as Xposition; values [T, c] are its columns."""

    name: str
    offset: tuple[float, float, float]
    channels: tuple[str, ...] = ()
    values: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    children: tuple["Node", ...] = ()
    end: tuple[float, float, float] | None = None
    adds: bool = False
    """Whether the position channels are added to the OFFSET, rather than in its place."""


def text(
    root: Node, frame_s: float = 0.05, head: str = "MOTION\nFrames: {}\nFrame Time: {}"
) -> str:
    """The file's text."""
    lines = ["HIERARCHY", *_lines(root, "ROOT", "")]
    columns = [node.values for node in _all(root) if node.channels]
    rows = np.concatenate(columns, axis=1)
    lines.append(head.format(len(rows), frame_s))
    return "\n".join([*lines, *(" ".join(f"{v:.9f}" for v in row) for row in rows)]) + "\n"


def positions(root: Node, frames: int) -> dict[str, np.ndarray]:
    """Joint positions [T, 3] by name, from matrices of each channel in its order."""
    found: dict[str, np.ndarray] = {}

    def visit(node: Node, above: np.ndarray) -> None:
        here = above.copy()
        for frame in range(frames):
            offset = np.array(node.offset, dtype=float)
            turn = np.eye(3)
            for channel, value in zip(node.channels, node.values[frame], strict=True):
                axis = LETTERS[channel[0]]
                if channel.endswith("position"):
                    offset[axis] = value + (node.offset[axis] if node.adds else 0.0)
                else:
                    angle = np.zeros(3)
                    angle[axis] = np.deg2rad(value)
                    turn = turn @ Rotation.from_rotvec(angle).as_matrix()
            local = np.eye(4)
            local[:3, :3], local[:3, 3] = turn, offset
            here[frame] = above[frame] @ local
        found[node.name] = here[:, :3, 3]
        for child in node.children:
            visit(child, here)

    visit(root, np.tile(np.eye(4), (frames, 1, 1)))
    return found


def _all(node: Node) -> list[Node]:
    return [node, *(one for child in node.children for one in _all(child))]


def _lines(node: Node, kind: str, pad: str) -> list[str]:
    x, y, z = node.offset
    lines = [f"{pad}{kind} {node.name}", f"{pad}{{", f"{pad}\tOFFSET {x} {y} {z}"]
    if node.channels:
        lines.append(f"{pad}\tCHANNELS {len(node.channels)} {' '.join(node.channels)}")
    for child in node.children:
        lines += _lines(child, "JOINT", pad + "\t")
    if node.end is not None:
        x, y, z = node.end
        lines += [f"{pad}\tEnd Site", f"{pad}\t{{", f"{pad}\t\tOFFSET {x} {y} {z}", f"{pad}\t}}"]
    return [*lines, f"{pad}}}"]
