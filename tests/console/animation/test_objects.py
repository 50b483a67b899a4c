"""Objects of a scene: their shapes closed and of the right size, their places those of the take."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from console.animation import objects
from console.animation.objects import Object, Shape
from console.recording import format as recording
from tests.support.console.moving_takes import carried, followed, pushed
from world.motions.objects import BoxTrack


def closed(shape: Shape) -> trimesh.Trimesh:
    found = trimesh.Trimesh(shape.vertices, shape.faces)
    found.merge_vertices(merge_norm=True, merge_tex=True)
    return found


def of(take: recording.Take) -> dict[str, Object]:
    return {one.name: one for one in objects.of_take(take, recording.model_of(take))}


def test_a_pushed_chair_and_balls() -> None:
    take = pushed()
    found = of(take)
    chair = found[take.piece]
    assert set(found) == {take.piece, "projectile0", "projectile1"} and chair.moves
    np.testing.assert_allclose(chair.position, take.mocap_pos, atol=1e-12)
    turned = Rotation.from_quat(take.mocap_quat, scalar_first=True).as_matrix()
    np.testing.assert_allclose(chair.rotation, turned, atol=1e-12)
    assert len(chair.shapes) == len(take.boxes)
    for shape, row in zip(chair.shapes, take.boxes, strict=True):
        solid = closed(shape)
        assert solid.is_watertight and solid.volume == pytest.approx(8 * np.prod(row[3:6]))
        np.testing.assert_allclose(solid.center_mass, row[:3], atol=1e-9)


def test_a_ball_is_seen_while_it_is_thrown() -> None:
    take = pushed()
    found = of(take)
    late = found["projectile1"]
    assert late.shown is not None and late.shown.sum() == 15 and late.shown[5:20].all()
    np.testing.assert_allclose(late.position[5:20], take.balls[5:20, 1], atol=1e-9)
    # it waits where it comes, and stays where it went
    np.testing.assert_array_equal(late.position[0], late.position[5])
    np.testing.assert_array_equal(late.position[-1], late.position[19])
    first = found["projectile0"].shown
    assert first is not None and first.all()
    solid = closed(late.shapes[0])
    assert solid.is_watertight
    assert solid.volume == pytest.approx(4 / 3 * np.pi * 0.09**3, rel=0.06)
    np.testing.assert_allclose(np.linalg.norm(late.shapes[0].vertices, axis=1), 0.09, atol=1e-9)


def test_a_box_between_its_stands() -> None:
    take = carried()
    found = of(take)
    assert set(found) == {"box", "first_stand", "target_stand"}
    np.testing.assert_allclose(found["box"].position, take.qpos[:, 43:46], atol=1e-12)
    assert closed(found["box"].shapes[0]).volume == pytest.approx(0.35 * 0.5 * 0.3)
    for name, height in (("first_stand", 0.6), ("target_stand", 0.7)):
        stand = found[name]
        assert not stand.moves
        low = min(shape.vertices[:, 2].min() for shape in stand.shapes) + stand.position[0, 2]
        high = max(shape.vertices[:, 2].max() for shape in stand.shapes) + stand.position[0, 2]
        assert (low, high) == pytest.approx((0.0, height)), "from the floor up"
        assert all(closed(shape).is_watertight for shape in stand.shapes)


def test_a_scene_without_objects_has_none() -> None:
    assert of(followed()) == {}


def test_a_mesh_of_its_own_takes_the_place_of_the_boxes() -> None:
    take = pushed()
    mesh = objects.surface(np.eye(3), np.array([[0, 1, 2]]), (1.0, 0.0, 0.0, 1.0))
    found = objects.of_take(take, recording.model_of(take), mesh)
    (chair,) = [one for one in found if one.name == take.piece]
    assert len(chair.shapes) == 1 and len(chair.shapes[0].faces) == 1
    # in the colour that a chair has
    assert chair.shapes[0].colour == of(take)[take.piece].shapes[0].colour


def test_triangles_without_area_are_left_out() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0.0]])
    made = objects.surface(points, np.array([[0, 1, 2], [0, 1, 3]]), (1.0, 1.0, 1.0, 1.0))
    assert len(made.faces) == 1
    np.testing.assert_allclose(made.normals, np.tile((0, 0, 1.0), (3, 1)))


def test_the_box_of_a_clip() -> None:
    pose = np.array([[0, 0, 1, 1, 0, 0, 0], [0, 1, 1, np.sqrt(0.5), 0, 0, np.sqrt(0.5)]])
    track = BoxTrack(pose.astype(np.float32), (0.2, 0.4, 0.6), np.zeros(2, bool))
    made = objects.of_box(track)
    assert made.moves and closed(made.shapes[0]).volume == pytest.approx(0.048)
    np.testing.assert_allclose(made.rotation[1] @ (1, 0, 0), (0, 1, 0), atol=1e-6)
