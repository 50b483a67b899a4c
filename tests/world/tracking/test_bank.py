"""The scenes of tracking: what their stands touch."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch

from tests.support.track_scenes import WORLD, bank, clips, followed
from world.scene.batch import Scenes
from world.scene.box import BOX_BODY, PASSABLE
from world.scene.model import SOLID
from world.scene.warp_model import template
from world.tracking.bank import TrackBank
from world.tracking.reference import reference
from world.tracking.sampler import TrackSampler


def test_a_stand_bears_the_box_and_lets_the_character_pass() -> None:
    """The stands are ours: who was recorded may have walked where one is."""
    alone = TrackBank(clips()[:2], reference(clips()[:2]), WORLD.track)
    frame = torch.tensor([0])
    sampler = TrackSampler(WORLD, alone, 0)
    states = sampler.at(frame, torch.zeros(1))
    model = alone.models[int(states.variant[0])]
    scenes = Scenes([model], WORLD.action_scale, WORLD.action_clip)
    sampler.apply(scenes, torch.arange(1), states)
    state = scenes.physics()
    data = mujoco.MjData(model)
    data.qpos[:] = state["qpos"][0].numpy()[: model.nq]
    data.mocap_pos[:] = state["mocap_pos"][0].numpy()
    data.mocap_quat[:] = state["mocap_quat"][0].numpy()
    rest = data.qpos[43:46].copy()
    # the character stands in the middle of the box's stand
    data.qpos[:2] = rest[:2]
    data.qpos[2] += 0.3
    touched: set[str] = set()
    for _ in range(200):
        mujoco.mj_step(model, data)
        data.qvel[:34] = 0.0
        data.qpos[:2] = rest[:2] + np.array((0.0, 0.45))
        for contact in data.contact:
            names = {model.body(model.geom_bodyid[g]).name for g in contact.geom}
            touched |= names if "furniture" in names else set()
    assert touched == {"furniture", BOX_BODY}
    assert bool(alone.reference.has_picked[0])
    assert np.abs(data.qpos[43:46] - rest).max() < 0.01
    # the template of the other simulator has the same setting
    made = template(alone.models, alone.pieces).model
    for body in ("furniture", "stand"):
        first = int(made.body(body).geomadr[0])
        assert (made.geom_contype[first], made.geom_conaffinity[first]) == PASSABLE
    # beside a seat all is solid, and where it is asked for
    firm = TrackBank(clips()[:2], alone.reference, replace(WORLD.track, solid=True)).models[0]
    assert int(firm.geom_contype[firm.body("furniture").geomadr[0]]) == SOLID[0]
    assert int(firm.geom_contype[firm.body("stand").geomadr[0]]) == SOLID[0]
    solid = bank().models[0]
    assert int(solid.geom_contype[solid.body("stand").geomadr[0]]) == SOLID[0]


def test_initial_states_in_chosen_clips_alone() -> None:
    some = bank().starting_in([True, False, False, False])
    started = torch.nonzero(some.reference.start_weight > 0).flatten()
    assert followed().clip[started].unique().tolist() == [0]
    assert len(started) == int((followed().start_weight[followed().clip == 0] > 0).sum())
    # the bank itself is as it was
    assert bank().reference is followed()


def test_boxes_weigh_by_volume_where_it_is_asked_for() -> None:
    """As in carry: 4 kg at 35 × 50 × 30 cm."""
    config = replace(WORLD.track, by_volume=True, boxes=3, size=(0.8, 1.4))
    found = TrackBank(clips()[:1], reference(clips()[:1]), config)
    for model in found.models:
        box = model.body(BOX_BODY)
        edges = 2.0 * model.geom_size[int(box.geomadr[0])]
        assert float(box.mass[0]) == pytest.approx(
            4.0 * edges.prod() / (0.35 * 0.5 * 0.3), rel=1e-5
        )
    masses = [float(model.body(BOX_BODY).mass[0]) for model in found.models]
    assert masses == sorted(masses) and masses[-1] > 2.0 * masses[0]
