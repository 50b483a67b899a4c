"""Retargeting against known truth: our own walk, as another body would have recorded it."""

import numpy as np
import torch

from world import rotations
from world.character import model as character
from world.motions import measures
from world.motions.clip import Clip
from world.motions.fit import poses


def aligned(clip: Clip) -> np.ndarray:
    """Body positions [T, 15, 3] seen from where the clip begins."""
    position = poses.body_poses(clip)[0].numpy()
    yaw = rotations.heading(torch.from_numpy(clip.local_rotation[:1, 0]))
    seen = rotations.turn_back(yaw[:, None], torch.from_numpy(position - position[:1, :1]))
    return seen.numpy() + np.array([0, 0, position[0, 0, 2]])


def test_another_bodys_walk_is_ours_again(walking: Clip, imported: Clip) -> None:
    assert imported.fps == character.CONTROL_HZ
    assert imported.frames == walking.frames
    apart = np.linalg.norm(aligned(imported) - aligned(walking), axis=-1)
    # hands and feet, and the whole body: size, axes and zero pose are undone
    assert apart[:, [5, 8, 11, 14]].mean() < 0.02
    assert apart.mean() < 0.02
    assert measures.key_body_error_m(imported) < 0.02
