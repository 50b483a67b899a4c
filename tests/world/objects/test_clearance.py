"""Penetration of the furniture, against MuJoCo's own contacts."""

import mujoco
import numpy as np
import pytest
import torch

from world.character import model as character
from world.furniture.catalogue import find
from world.objects import clearance
from world.objects.furniture_bank import FurnitureBank
from world.scene import model as scene


@pytest.mark.parametrize("name", ["chair-train-000", "armchair-test-001", "low-stool-train-002"])
def test_depth_is_that_of_the_simulators_contacts(name: str) -> None:
    bank = FurnitureBank([find(name)])
    data = mujoco.MjData(bank.models[0])
    furniture = bank.models[0].body(scene.FURNITURE_BODY).id
    rng = np.random.default_rng(1)
    compared = 0
    for _ in range(60):
        qpos = character.standing_qpos()
        qpos[:3] = (0.0, 0.0, rng.uniform(0.4, 0.9))
        origin = np.array([*rng.uniform(-0.4, 0.4, 2), 0.0])
        yaw = rng.uniform(-3, 3)
        data.qpos[:] = qpos
        data.mocap_pos[0], data.mocap_quat[0] = origin, (np.cos(yaw / 2), 0, 0, np.sin(yaw / 2))
        mujoco.mj_forward(bank.models[0], data)
        depths = []
        for contact in data.contact:
            bodies = bank.models[0].geom_bodyid[list(contact.geom)]
            names = [bank.models[0].geom(g).name for g in contact.geom]
            # feet and clavicles have no sphere: the floor and the torso stand for them
            if furniture in bodies and not any("foot" in n or "clavicle" in n for n in names):
                depths.append(-contact.dist)
        found = clearance.depth(
            clearance.points(torch.from_numpy(qpos[None]).float()),
            torch.from_numpy(origin[None]).float(),
            torch.tensor([[np.cos(yaw), np.sin(yaw)]], dtype=torch.float32),
            bank,
            torch.tensor([0]),
        ).item()
        # spheres leave gaps of up to 1 cm along a capsule; how deep, MuJoCo says of spheres alone
        if abs(found) > 0.01:
            assert (found > 0) == bool(depths), (found, depths)
            compared += 1
    assert compared > 20


def test_depth_by_hand() -> None:
    """The head, a sphere of 9.5 cm, 5 cm above the top of a solid block that it stands over."""
    bank = FurnitureBank([find("low-stool-train-002")])
    top = float((bank.box_centre + bank.box_half)[0, bank.box_used[0], 2].max())
    centre_z = top + 0.05
    qpos = torch.from_numpy(character.standing_qpos()).float()[None]
    points = clearance.points(qpos)
    head = points[:, 3].clone()
    assert head[0, 2].item() == pytest.approx(qpos[0, 2].item() + 0.236151 + 0.223894 + 0.175)
    far = torch.full_like(points, 50.0)
    far[:, 3] = torch.tensor([0.0, 0.0, centre_z])
    found = clearance.depth(
        far, torch.zeros(1, 3), torch.tensor([[1.0, 0.0]]), bank, torch.tensor([0])
    )
    assert found.item() == pytest.approx(0.095 - 0.05, abs=1e-5)
