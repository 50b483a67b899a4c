"""The skinned surface: closed, of the display model's shape, moved by the bodies that it covers."""

import mujoco
import numpy as np
import trimesh

from console.animation import body_mesh
from console.video import stage
from world.character import model as character

MESH = body_mesh.body_mesh()
FACES = np.concatenate(list(MESH.faces.values()))


def test_it_is_one_closed_surface() -> None:
    surface = trimesh.Trimesh(MESH.vertices, FACES, process=False)
    assert surface.is_watertight and surface.is_winding_consistent and surface.body_count == 1
    # 48.9 kg of a person of 1.62 m, at about the density of water
    assert 0.05 < surface.volume < 0.07
    inwards = (surface.vertex_normals * MESH.normals).sum(axis=1) < 0.5
    assert inwards.mean() < 0.002, "normals of the shape are those of the triangles"
    np.testing.assert_allclose(np.linalg.norm(MESH.normals, axis=1), 1.0, atol=1e-9)


def test_it_is_the_surface_of_the_shapes_that_films_show() -> None:
    """MuJoCo's own signed distance of every vertex to the nearest shape of the display model."""
    model = stage.character_alone("body")
    data = mujoco.MjData(model)
    position, turns = body_mesh.pose()
    # the pose by its joints: raised arms, legs apart
    from scipy.spatial.transform import Rotation

    data.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
    address = 7
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        parent = character.PARENTS[body]
        own = turns[parent].T @ turns[body]
        if joint.is_ball:
            quaternion = Rotation.from_matrix(own).as_quat(scalar_first=True)
            data.qpos[address : address + 4] = quaternion
        address += 4 if joint.is_ball else 1
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(data.xpos[1:], position, atol=1e-6)
    shown = np.flatnonzero(model.geom_group == stage.SHOWN)
    near = np.full(len(MESH.vertices), np.inf)
    for geom in shown:
        own = (MESH.vertices - data.geom_xpos[geom]) @ data.geom_xmat[geom].reshape(3, 3)
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
            radius, half = model.geom_size[geom][:2]
            own[:, 2] -= np.clip(own[:, 2], -half, half)
            away = np.linalg.norm(own, axis=1) - radius
        else:
            # on the ray from the centre
            away = np.linalg.norm(own, axis=1) * (
                1 - 1 / np.linalg.norm(own / model.geom_size[geom], axis=1)
            )
        near = np.minimum(near, away)
    # where shapes meet, the blend rounds the crease
    assert near.min() > -0.012 and near.max() < 0.03
    assert np.percentile(np.abs(near), 80) < 0.012


def test_both_sides_are_alike() -> None:
    mirrored = MESH.vertices * np.array([1, -1, 1])
    from scipy.spatial import cKDTree

    away, _ = cKDTree(MESH.vertices).query(mirrored)
    assert np.percentile(away, 99) < body_mesh.GRID_M


def test_weights_are_of_the_body_below_and_its_neighbours() -> None:
    assert MESH.weights.shape == MESH.bodies.shape == (len(MESH.vertices), 4)
    np.testing.assert_allclose(MESH.weights.sum(axis=1), 1.0, atol=1e-12)
    assert (MESH.weights >= 0).all() and (MESH.bodies[MESH.weights == 0] == 0).all()
    for bodies, weights in zip(MESH.bodies[::50], MESH.weights[::50], strict=True):
        first = int(bodies[0])
        for body in bodies[weights > 0]:
            parents = character.PARENTS
            assert body == first or parents[body] == first or parents[first] == body
    # each body moves part of the surface alone, and the middle of a limb is moved by nothing else
    alone = {int(b[0]) for b, w in zip(MESH.bodies, MESH.weights, strict=True) if w[0] > 0.99}
    assert alone == set(range(15))


def test_clothes_cover_the_body() -> None:
    area = {}
    for colour, faces in MESH.faces.items():
        a, b, c = np.moveaxis(MESH.vertices[faces], 1, 0)
        area[colour] = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert len(area) == len(stage.CLOTHES)
    assert 1.0 < sum(area.values()) < 1.8, "m2"
    assert min(area.values()) > 0.05
