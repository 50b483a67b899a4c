"""Overlap with the furniture, by hand: a seat is raised into the character."""

import numpy as np

from console.evaluation import penetration
from world.character import model as character
from world.furniture.piece import Box, Piece
from world.scene.model import compile_scene

BLOCK = Piece("block", "chair", (Box((0.0, 0.0, 0.0), (0.3, 0.3, 0.02)),), (), 1.0)


def test_depth_grows_as_the_block_rises_into_the_feet() -> None:
    model = compile_scene(BLOCK)
    qpos = np.tile(character.standing_qpos(), (4, 1))
    position = np.zeros((4, 3))
    # its top at −0.1 m (below the feet), and 0.5, 1.0 and 1.5 cm above their soles
    position[:, 2] = np.array([-0.1, 0.005, 0.010, 0.015]) - 0.02
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (4, 1))
    depth = penetration.depth(model, qpos, position, quat, range(4))
    assert depth[0] == 0.0 and depth[1] > 0.0
    np.testing.assert_allclose(np.diff(depth[1:]), 0.005, atol=1e-3)


def test_only_the_requested_frames_are_measured() -> None:
    model = compile_scene(BLOCK)
    qpos = np.tile(character.standing_qpos(), (3, 1))
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    depth = penetration.depth(model, qpos, np.full((3, 3), 9.0), quat, [0, 2])
    assert depth.tolist() == [0.0, 0.0]
