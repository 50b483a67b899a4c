"""BVH by hand and by another library."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support import foreign_motions
from tests.support.samp_clips import FOLDER
from tests.support.world import bvh_texts
from tests.support.world.bvh_texts import Node
from world.errors import ClipError
from world.motions.formats import registry

SHARED = FOLDER.parent


def test_bvh_by_hand(tmp_path: Path) -> None:
    # the root turns by 90 degrees about z, its child by 90 about x: (1, 0, 0) -> (0, 1, 0)
    names, parents = ("Hips", "Chest", "Tip"), (-1, 0, 1)
    offset = np.array([[5.0, 6, 7], [1, 0, 0], [0, 2, 0]])
    local = np.tile(np.eye(3), (3, 3, 1, 1))
    local[1:, 0] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    local[1:, 1] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    root = np.tile([10.0, 20, 30], (3, 1))
    path = foreign_motions.write_bvh(tmp_path / "a.bvh", root, local, offset, 25, names, parents)
    read = registry.read(path)
    assert read.names[:3] == names
    assert read.fps == pytest.approx(25, rel=1e-3)
    # the root's OFFSET is not added to its channels
    np.testing.assert_allclose(read.position[1, 0], [10, 20, 30])
    np.testing.assert_allclose(read.position[1, 1], [10, 21, 30], atol=1e-9)
    # (0, 2, 0) in the child: about x to (0, 0, 2), about z it stays
    np.testing.assert_allclose(read.position[1, 2], [10, 21, 32], atol=1e-9)


POSITION = ("Xposition", "Yposition", "Zposition")
FRAMES = 7
OFFSET = (0.0, 90.0, 0.0)


def _values(seed: int, columns: int, scale: float = 40.0) -> np.ndarray:
    return scale * np.random.default_rng(seed).standard_normal((FRAMES, columns))


def _travel(seed: int, start: tuple[float, float, float]) -> np.ndarray:
    """[T, 3]: a way from a place on."""
    steps = np.abs(_values(seed, 3, 5.0)) * (1, 0.1, 1)
    return np.array(start) + np.cumsum(steps, axis=0) - steps[0]


def _limb(name: str, channels: tuple[str, ...], seed: int) -> Node:
    return Node(name, (3.0, -4.0, 1.0), channels, _values(seed, len(channels)), end=(1, 2, 3))


def _same(tmp_path: Path, root: Node) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(bvh_texts.text(root))
    read = registry.read(path)
    for name, expected in bvh_texts.positions(root, FRAMES).items():
        found = read.position[:, read.names.index(name)]
        np.testing.assert_allclose(found, expected[FRAMES - read.frames :], atol=1e-6, err_msg=name)


@pytest.mark.parametrize(
    ("root_channels", "hips_offset", "hips_at", "adds"),
    [
        # the channels of the hips are where they are, and OFFSET is 0, at rest, or the first frame
        (("Zrotation", "Xrotation", "Yrotation"), (0.0, 0.0, 0.0), (1.0, 83.0, 220.0), False),
        ((*POSITION, "Yrotation"), OFFSET, (1.0, 83.0, 220.0), False),
        ((), (1.0, 83.0, 220.0), (1.0, 83.0, 220.0), False),
        # or they are relative to an OFFSET at rest
        (POSITION, OFFSET, (0.0, 0.0, 0.0), True),
        (("Yrotation",), OFFSET, (30.0, 2.0, -10.0), True),
    ],
)
def test_positions_below_the_root_carry_the_motion(
    tmp_path: Path,
    root_channels: tuple[str, ...],
    hips_offset: tuple[float, float, float],
    hips_at: tuple[float, float, float],
    adds: bool,
) -> None:
    values = np.concatenate((_travel(5, hips_at), _values(2, 3)), axis=1)
    hips = Node("Hips", hips_offset, (*POSITION, "Zrotation", "Xrotation", "Yrotation"), values,
                (_limb("Leg", ("Zrotation", "Yrotation", "Xrotation"), 3),), adds=adds)  # fmt: skip
    root = Node("Reference", (0, 0, 0), root_channels, _values(1, len(root_channels)), (hips,))
    _same(tmp_path, root)


@pytest.mark.parametrize(
    "channels",
    [
        (),
        ("Yrotation",),
        ("Xrotation", "Yrotation", "Xrotation"),
        ("Yrotation", "Xrotation"),
        ("Xposition", "Yposition", "Zposition"),
        ("Zrotation", "Yposition", "Xrotation"),
        ("Zrotation", "Xrotation", "Yrotation", "Zposition", "Yposition", "Xposition"),
    ],
)
def test_joints_of_any_channels(tmp_path: Path, channels: tuple[str, ...]) -> None:
    limb = _limb("Leg", channels, 4)
    # bones' channels repeat their OFFSET
    for column, channel in enumerate(channels):
        if channel.endswith("position"):
            limb.values[:, column] = limb.offset["XYZ".index(channel[0])]
    below = _limb("Foot", ("Xrotation", "Yrotation", "Zrotation"), 5)
    limb.children, limb.end = (below,), None
    _same(tmp_path, Node("Hips", (9, 9, 9), (*POSITION, "Yrotation"), _values(6, 4), (limb,)))


def test_lengths_in_the_channels_over_offsets_of_0(tmp_path: Path) -> None:
    six = (*POSITION, "Zrotation", "Xrotation", "Yrotation")

    def bone(name: str, along: tuple[float, float, float], seed: int, *below: Node) -> Node:
        values = np.concatenate((np.tile(along, (FRAMES, 1)), _values(seed, 3)), axis=1)
        return Node(name, (0, 0, 0), six, values, below, None if below else (0, 0, 0))

    _same(
        tmp_path,
        bone("Hips", (1, 2, 3), 1, bone("Leg", (0, -40, 0), 2, bone("Foot", (0, -39, 2), 3))),
    )


def test_the_rate_is_the_files_or_the_given_one(tmp_path: Path) -> None:
    root = Node("Hips", (0, 0, 0), (*POSITION, "Yrotation"), _values(1, 4), end=(0, 1, 0))
    path = tmp_path / "a.bvh"
    path.write_text(bvh_texts.text(root, 0.05))
    assert registry.read(path).fps == pytest.approx(20)
    assert registry.read(path, fps=60).fps == 60
    for absent in ("MOTION\nFrames: {}", "MOTION\nFrames: {}\nFrame Time: 0"):
        path.write_text(bvh_texts.text(root, head=absent))
        with pytest.raises(ClipError, match="Frame Time is missing or 0; --fps states the rate"):
            registry.read(path)
        assert registry.read(path, fps=25).fps == 25


@pytest.mark.skipif(not (SHARED / "accad").is_dir(), reason="no ../shared/motions")
@pytest.mark.parametrize("name", ["accad/Male1_B20_WalkWithBox.bvh", "cmu/08_01.bvh"])
def test_bvh_positions_are_the_librarys(name: str) -> None:
    import pybvh

    read = registry.read(SHARED / name)
    theirs = pybvh.read_bvh_file(SHARED / name, world_up="+y").node_positions()
    # frame 0 of CMU's conversion is a pose put in front
    added = len(theirs) - read.frames
    assert added == (1 if name.startswith("cmu") else 0)
    np.testing.assert_allclose(read.position, theirs[added:], atol=1e-4)
