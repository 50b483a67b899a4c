"""Variants of a carrying clip: the box rests on the stand, the hands hold it in every frame."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from world import rotations
from world.character import features
from world.character import model as character
from world.motions import segments
from world.motions.clip import Clip, mirrored
from world.motions.synthetic.carries import carrying
from world.motions.variants import variant

EDGES = (0.25, 0.36, 0.22)
STAND_M = 0.25
HANDS = [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]


@pytest.fixture(scope="module")
def clip() -> Clip:
    return carrying(np.random.default_rng(3), EDGES, (STAND_M, STAND_M), 1.5, 0.6)


def gaps_m(clip: Clip) -> np.ndarray:
    """[T, 2]: from each hand's surface to the box, m; negative inside."""
    assert clip.box is not None
    qpos = torch.from_numpy(clip.qpos())
    hands = features.body(qpos, torch.zeros(len(qpos), character.NV)).position[:, HANDS]
    pose = torch.from_numpy(clip.box.pose)
    axes = rotations.matrix(pose[:, 3:])[:, None]
    local = ((hands - pose[:, None, :3])[..., None] * axes).sum(dim=-2)
    beyond = local.abs() - 0.5 * torch.tensor(clip.box.size_m)
    outside = beyond.clamp_min(0.0).norm(dim=-1) + beyond.amax(dim=-1).clamp_max(0.0)
    return (outside - 0.04).numpy()


@pytest.mark.parametrize(("stand_m", "size"), [(0.4, 1.0), (0.55, 1.25), (0.7, 0.85)])
def test_the_box_is_taken_from_and_put_on_the_stand(
    clip: Clip, stand_m: float, size: float
) -> None:
    found = variant(clip, stand_m, size)
    assert found is not None and found.box is not None and clip.box is not None
    edges = np.array(EDGES) * size
    np.testing.assert_allclose(found.box.size_m, edges, rtol=1e-6)
    rest = stand_m + 0.5 * edges[2]
    for height in (found.box.pose[0, 2], found.box.pose[-1, 2]):
        # the first frame in which the box is so high: within a frame's rise
        assert rest <= height < rest + 0.05
    gaps, held = gaps_m(found), found.box.held
    assert np.abs(gaps[held]).max() < 0.006
    assert gaps[~held].min() > -0.02, "open hands come from beside the box"
    # it begins and ends as the clip does, and is shorter by what it need not bend
    for frame in (0, -1):
        np.testing.assert_allclose(
            found.root_position_m[frame], clip.root_position_m[frame], atol=1e-6
        )
    assert found.frames < clip.frames and found.licence == clip.licence
    assert segments.usable(found).mean() > 0.9
    fastest = np.abs(found.qvel()[:, 6:]).max()
    assert fastest < max(12.0, np.abs(clip.qvel()[:, 6:]).max() + 1.0)


def test_a_lower_stand_leaves_the_height_as_it_is(clip: Clip) -> None:
    found = variant(clip, 0.05, 1.0)
    assert found is not None and found.box is not None and clip.box is not None
    held = np.flatnonzero(clip.box.held)
    assert found.box.pose[0, 2] == pytest.approx(clip.box.pose[held[0], 2], abs=1e-6)
    # the legs and the trunk are the clip's own while the box is in hand
    legs = [character.BODIES.index(f"{side}_thigh") for side in ("right", "left")]
    mine, theirs = np.flatnonzero(found.box.held), held
    turned = np.abs(
        (found.local_rotation[mine][:, legs] * clip.local_rotation[theirs][:, legs]).sum(axis=-1)
    )
    np.testing.assert_allclose(turned, 1.0, atol=1e-5)


def test_a_mirror_image_has_the_mirrored_variant(clip: Clip) -> None:
    one, other = variant(mirrored(clip), 0.5, 1.2), variant(clip, 0.5, 1.2)
    assert one is not None and other is not None
    image = mirrored(other)
    np.testing.assert_allclose(one.root_position_m, image.root_position_m, atol=1e-5)
    same = np.abs((one.local_rotation * image.local_rotation).sum(axis=-1))
    np.testing.assert_allclose(same, 1.0, atol=1e-4)


def test_what_has_no_variant(clip: Clip) -> None:
    assert variant(clip, 1.6, 1.0) is None
    assert variant(replace(clip, box=None), 0.5, 1.0) is None
    assert clip.box is not None
    held = np.flatnonzero(clip.box.held)
    twice = clip.box.held.copy()
    twice[held[len(held) // 2]] = False
    assert variant(replace(clip, box=replace(clip.box, held=twice)), 0.5, 1.0) is None
    inside = clip.part(int(held[0]), int(held[-1]) + 1)
    walks = variant(inside, 0.5, 1.25)
    assert walks is not None and walks.box is not None
    assert walks.frames == inside.frames and walks.name == f"{clip.name}~x1.25"
    assert np.abs(gaps_m(walks)).max() < 0.006


def stretch(clip: Clip) -> np.ndarray:
    """[T]: distance from shoulder to hand of the more stretched arm, in lengths of the arm."""
    qpos = torch.from_numpy(clip.qpos())
    position = features.body(qpos, torch.zeros(len(qpos), character.NV)).position
    arms = ("right", "left")
    shoulders = [character.BODIES.index(f"{side}_upper_arm") for side in arms]
    apart = (position[:, HANDS] - position[:, shoulders]).norm(dim=2).amax(dim=1)
    return apart.numpy() / (0.274788 + 0.258947)


def test_arms_that_hold_a_larger_box_are_bent(clip: Clip) -> None:
    """It is held higher for that: straight arms have nothing left to press with."""
    assert clip.box is not None
    plain, large = variant(clip, 0.4, 1.0), variant(clip, 0.4, 1.9)
    assert plain is not None and plain.box is not None
    assert large is not None and large.box is not None
    assert np.quantile(stretch(large)[large.box.held], 0.9) < 0.93
    assert np.abs(gaps_m(large)[large.box.held]).max() < 0.006
    # above what its half height alone lifts its centre by, while it is carried
    most = [found.box.pose[:, 2].max() for found in (plain, large)]
    assert most[1] - most[0] > 0.5 * EDGES[2] * 0.9 + 0.03
