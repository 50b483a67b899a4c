"""Left and right exchanged: the mirrored action in the mirrored scene gives the mirrored future, by
the simulator itself."""

import numpy as np
import pytest
import torch
from torch import Tensor

from world import random_streams, tasks
from world.character import features
from world.character import model as character
from world.furniture.catalogue import find
from world.furniture.piece import Box, Piece, SeatTarget
from world.furniture.usage import use_points
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.tasks import Target, symmetry

N, STEPS = 16, 6


def mirrored_state(qpos: Tensor, qvel: Tensor) -> tuple[Tensor, Tensor]:
    """The reflection in y = 0 of generalised coordinates, written out by hand."""
    swap = [character.JOINTS.index(j) for j in map(partner, character.JOINTS)]
    out_q, out_v = qpos.clone(), qvel.clone()
    out_q[:, :7] = qpos[:, :7] * qpos.new_tensor([1, -1, 1, 1, -1, 1, -1])
    out_v[:, :6] = qvel[:, :6] * qvel.new_tensor([1, -1, 1, -1, 1, -1])
    starts, q, v = [], 7, 6
    for joint in character.JOINTS:
        starts.append((q, v))
        q, v = (q + 4, v + 3) if joint.is_ball else (q + 1, v + 1)
    for here, there in enumerate(swap):
        (q, v), (q2, v2) = starts[here], starts[there]
        if character.JOINTS[here].is_ball:
            out_q[:, q : q + 4] = qpos[:, q2 : q2 + 4] * qpos.new_tensor([1, -1, 1, -1])
            out_v[:, v : v + 3] = qvel[:, v2 : v2 + 3] * qvel.new_tensor([-1, 1, -1])
        else:
            out_q[:, q], out_v[:, v] = qpos[:, q2], qvel[:, v2]
    return out_q, out_v


def partner(joint: character.Joint) -> character.Joint:
    other = joint.name.replace("right", "?").replace("left", "right").replace("?", "left")
    return next(j for j in character.JOINTS if j.name == other)


def block() -> Piece:
    """Alike on both sides, since the mirror image of a piece is another piece."""
    box = Box((0.0, 0.0, 0.25), (0.5, 1.0, 0.25))
    spot = SeatTarget((0.1, 0.0, 0.5), 0.0)
    return Piece("block", "chair", (box,), (spot,), 30.0)


def scene(
    qpos: Tensor, qvel: Tensor, point: Tensor, facing: Tensor, bank: FurnitureBank
) -> tuple[Scenes, Target]:
    scenes = Scenes([bank.models[0]] * N, 0.35, 3.0)
    variant = torch.zeros(N, dtype=torch.int64)
    scenes.set_state(torch.arange(N), qpos, qvel, *bank.placed(variant, point, facing))
    return scenes, bank.target(variant, point, facing)


def observation(task: tasks.Task, scenes: Scenes, place: Target) -> Tensor:
    body = scenes.body()
    return torch.cat((tasks.state(body, place), task.goal_features(body, place)), dim=1)


@pytest.mark.parametrize("name", ["sit", "lie"])
def test_the_mirrored_action_gives_the_mirrored_future(name: str) -> None:
    task = tasks.make(name)
    reflect = symmetry.symmetry(task)
    bank = FurnitureBank([block()])
    draws = random_streams.normal(3, torch.arange(N), 0, 34 + 28 + 4).double()
    qpos = torch.from_numpy(character.standing_qpos()).repeat(N, 1)
    qpos[:, 7:] += 0.1 * draws[:, :36]
    for q in (3, *character.BALL_QPOS):
        if q == 3:
            qpos[:, 3:7] += 0.2 * draws[:, 36:40]
        qpos[:, q : q + 4] /= qpos[:, q : q + 4].norm(dim=1, keepdim=True)
    qpos[:, 2] += 0.02
    qvel = 0.3 * random_streams.normal(4, torch.arange(N), 0, 34).double()
    point = torch.tensor([[0.9, 0.3]]) + 0.2 * draws[:, 40:42].float()
    facing = torch.nn.functional.normalize(draws[:, 42:44].float())
    flip = torch.tensor([1.0, -1.0])
    here, place = scene(qpos, qvel, point, facing, bank)
    there, image = scene(*mirrored_state(qpos, qvel), point * flip, facing * flip, bank)
    for step in range(STEPS):
        seen, expected = observation(task, there, image), observation(task, here, place)
        scale = 1.0 + expected.abs()
        difference = ((seen - reflect.observation(expected)).abs() / scale).max()
        assert difference < 2e-3, (step, float(difference))
        assert ((expected - reflect.observation(expected)).abs() / scale).max() > 0.1
        reward = task.reward_terms(here.body(), place)
        torch.testing.assert_close(
            task.reward_terms(there.body(), image), reward, atol=2e-3, rtol=1e-3
        )
        action = 0.5 * random_streams.normal(5, torch.arange(N), step, 28)
        torch.testing.assert_close(
            there.set_points(reflect.action(action)),
            reflect.action(here.set_points(action)),
            atol=1e-6,
            rtol=0,
        )
        here.act(action)
        there.act(reflect.action(action))


def test_a_table_is_the_same_from_both_sides() -> None:
    """Got onto from its other side, its head is to the right; in the mirror nothing differs."""
    task = tasks.make("lie")
    sides = symmetry.symmetry(task)
    piece = find("table-test-004")
    # two variants: the second is used from the other side
    bank = FurnitureBank([piece, piece], "lie")
    cross = [
        float(f[0] * (h - p)[1] - f[1] * (h - p)[0])
        for f, h, p in zip(bank.facing, bank.head, bank.point, strict=True)
    ]
    assert cross[0] < 0.0 < cross[1]
    qpos = torch.from_numpy(character.standing_qpos()).repeat(N, 1)
    draws = random_streams.normal(6, torch.arange(N), 0, 28 + 4)
    qpos[:, 7:] += 0.1 * draws[:, :28].repeat(1, 2)[:, :36].double()
    for q in character.BALL_QPOS:
        qpos[:, q : q + 4] /= qpos[:, q : q + 4].norm(dim=1, keepdim=True)
    qvel = 0.3 * random_streams.normal(4, torch.arange(N), 0, 34).double()
    point, facing = 2.0 * draws[:, 28:30], torch.nn.functional.normalize(draws[:, 30:32])
    flip = torch.tensor([1.0, -1.0])

    def seen(variant: int, q: Tensor, v: Tensor, at: Tensor, along: Tensor) -> Tensor:
        body = features.body(q.float(), v.float())
        place = bank.target(torch.full((N,), variant), at, along)
        x = torch.cat((tasks.state(body, place), task.goal_features(body, place)), dim=1)
        found, right = sides.canonical(x)
        assert right is not None and bool((right == (variant == 0)).all())
        return found

    right = seen(0, qpos, qvel, point, facing)
    left = seen(1, *mirrored_state(qpos, qvel), point * flip, facing * flip)
    torch.testing.assert_close(right, left, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("name", ["table-test-004", "bed-test-003", "sofa-test-000"])
def test_corners_come_in_the_order_of_the_place(name: str) -> None:
    piece = find(name)
    for spot in use_points(piece, "lie"):
        corners = spot.corners(piece)
        assert sorted(map(tuple, corners)) == sorted(map(tuple, piece.corners()))
        cos, sin = np.cos(spot.facing_rad), np.sin(spot.facing_rad)
        turned = corners - corners.mean(axis=0)
        x, y = turned[:, 0] * cos + turned[:, 1] * sin, turned[:, 1] * cos - turned[:, 0] * sin
        assert np.array_equal(np.sign(x), [-1, -1, -1, -1, 1, 1, 1, 1])
        assert np.array_equal(np.sign(y), [-1, -1, 1, 1, -1, -1, 1, 1])
        assert np.array_equal(np.sign(turned[:, 2]), [-1, 1, -1, 1, -1, 1, -1, 1])


def test_a_reflection_is_its_own_inverse_and_keeps_the_middle() -> None:
    for name in tasks.REGISTRY:
        reflect = symmetry.symmetry(tasks.make(name))
        x = torch.randn(5, len(reflect.observation.index))
        assert torch.equal(reflect.observation(reflect.observation(x)), x)
        assert sorted(reflect.observation.index.tolist()) == list(range(x.shape[1]))
    neutral = torch.from_numpy(character.neutral_set_points())
    torch.testing.assert_close(symmetry.actions()(neutral), neutral)
    low, high = (torch.from_numpy(b) for b in character.set_point_bounds())
    mirrored = symmetry.actions()
    torch.testing.assert_close(torch.minimum(mirrored(low), mirrored(high)), low)
