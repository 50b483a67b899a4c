"""Balls and displaced furniture in Synthesize: the evaluation's own physics, and refusals."""

from collections.abc import Iterator

import grpc
import numpy as np
import pytest
import torch

from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import Running, chair, fixed, make, refusal, running, stub
from world import tasks
from world.character import model as character
from world.furniture.catalogue import find
from world.objects.furniture_bank import FurnitureBank
from world.scene import perturbations
from world.scene.batch import Scenes
from world.scene.box import BOX_SIZE_M
from world.scene.perturbations import Thrower
from world.scene.target import state as state_of

SIT = tasks.make("sit")


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    with running([fixed(make()), fixed(make(2, "carry", "carry"))]) as found:
        yield found


def synthesised(
    server: Running, request: pb.SynthesizeRequest
) -> tuple[pb.SynthesisHeader, list[pb.Frame], pb.SynthesisSummary]:
    """Header, frames and summary of a request."""
    with stub(server) as client:
        parts = list(client.Synthesize(request, timeout=60))
    return parts[0].header, [part.frame for part in parts[1:-1]], parts[-1].summary


def thrown(seed: int, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Root [T, 3] and balls [T, 4, 3] of the sit policy under the evaluation's own projectiles,
    stepped by the bank, the scenes and the thrower alone."""
    served = make()
    what = perturbations.draw("projectiles", 1, seed, steps)
    bank = FurnitureBank([find("chair-test-000")], "sit", what.balls())
    scenes = Scenes(bank.models, served.world.action_scale, served.world.action_clip)
    here, facing = torch.tensor([0]), bank.facing
    point = torch.tensor([[2.0, 0.0]]) + bank.point[:, :2]
    place = bank.target(here, point, facing)
    qpos = character.standing_qpos()
    qpos[2] += 0.002
    placed = bank.placed(here, point, facing)
    scenes.set_state(here, torch.from_numpy(qpos)[None], torch.zeros(1, 34), *placed)
    thrower = Thrower(what, scenes)
    roots, balls = [scenes.qpos[0, :3].clone()], [thrower.position[0]]
    for step in range(steps):
        body = scenes.body()
        thrower.step(step, body, 1 / 30)
        state, goal = state_of(body, place), SIT.goal_features(body, place)
        scenes.act(served.policy(state, goal))
        roots.append(scenes.qpos[0, :3].clone())
        balls.append(thrower.position[0])
    return torch.stack(roots).numpy(), torch.stack(balls).numpy()


def test_balls_fly_as_in_an_evaluation(server: Running) -> None:
    request = pb.SynthesizeRequest(
        task="sit", furniture=chair(), seconds=1.0, to_the_end=True,
        projectiles=pb.Projectiles(seed=5),
    )  # fmt: skip
    header, frames, summary = synthesised(server, request)
    assert header.ball_radius_m == pytest.approx(0.09)
    assert summary.balls_thrown == 20 and not summary.displaced
    roots, balls = thrown(5, 30)
    # Inference of other rows at a time rounds otherwise, and hits make more of it: 0.2 mm seen.
    np.testing.assert_allclose([f.root_position for f in frames], roots, atol=2e-3)
    seen = np.full_like(balls, np.nan)
    for t, frame in enumerate(frames):
        for ball in frame.balls:
            seen[t, ball.number] = ball.position
    np.testing.assert_allclose(seen, balls, atol=2e-3)
    assert np.isfinite(seen).any() and np.isnan(seen[0]).all()


def test_a_seed_of_64_bits_throws_and_another_throws_otherwise(server: Running) -> None:
    def found(seed: int) -> list[float]:
        request = pb.SynthesizeRequest(
            task="sit", furniture=chair(), seconds=0.2, to_the_end=True,
            projectiles=pb.Projectiles(
                seed=seed, count=6, mass_kg=0.5, radius_m=0.05, speed_m_s=6.0
            ),
        )  # fmt: skip
        header, frames, summary = synthesised(server, request)
        assert summary.balls_thrown == 6 and header.ball_radius_m == pytest.approx(0.05)
        return list(frames[-1].balls[0].position)

    assert found(2**64 - 1) == found(2**64 - 1) != found(3)


def test_the_chair_moves_away_once(server: Running) -> None:
    request = pb.SynthesizeRequest(
        task="sit", furniture=chair(), seconds=1.0, to_the_end=True,
        displacement=pb.Displacement(seed=1, near_m=5.0, shift_m=0.75),
    )  # fmt: skip
    _, frames, summary = synthesised(server, request)
    assert summary.displaced and summary.balls_thrown == 0
    hip = np.array(find("chair-test-000").sit[0].point_m)

    def place(frame: pb.Frame) -> np.ndarray:
        w, _, _, z = frame.object_rotation
        yaw = 2 * np.arctan2(z, w)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        return np.array(frame.object_position[:2]) + turn @ hip[:2]

    path = np.array([place(frame) for frame in frames]) - place(frames[0])
    length = np.linalg.norm(path, axis=1)
    # smooth over half a second, s²(3 − 2s), then it stands; the character is at −x of it
    share = np.clip(np.arange(31) / 15, 0, 1)
    np.testing.assert_allclose(length, 0.75 * share**2 * (3 - 2 * share), atol=1e-4)
    assert path[-1, 0] >= -1e-4
    assert frames[-1].error_m > frames[0].error_m - 0.2
    far = pb.Displacement(seed=1, near_m=0.5)
    request.displacement.CopyFrom(far)
    _, still, summary = synthesised(server, request)
    assert not summary.displaced
    np.testing.assert_allclose([f.object_position for f in still], [[2.0, 0.0, 0.0]] * 31)


def test_a_box_goes_with_its_stand_and_is_hit(server: Running) -> None:
    box = pb.CarriedBox(
        position=[1.5, 0.0, 0.9], rotation=[1.0, 0.0, 0.0, 0.0], velocity=[0.0] * 3,
        size=BOX_SIZE_M, start=[1.5, 0.0, 0.9], goal=[3.0, 1.0, 0.8],
    )  # fmt: skip
    request = pb.SynthesizeRequest(
        task="carry", box=box, seconds=1.0, to_the_end=True,
        displacement=pb.Displacement(seed=4, near_m=5.0, shift_m=0.6),
        projectiles=pb.Projectiles(seed=1, count=3),
    )  # fmt: skip
    _, frames, summary = synthesised(server, request)
    assert summary.displaced and summary.balls_thrown == 3
    shift = np.array(frames[-1].object_position[:2]) - [1.5, 0.0]
    assert np.linalg.norm(shift) == pytest.approx(0.6, abs=0.02)
    assert frames[-1].object_position[2] == pytest.approx(0.9, abs=0.02)


def test_what_cannot_be_thrown_is_named(server: Running) -> None:
    def said(**more: object) -> str:
        request = pb.SynthesizeRequest(task="sit", furniture=chair(), seconds=0.5, **more)  # pyright: ignore
        with stub(server) as client:
            code, text = refusal(client.Synthesize(request, timeout=60))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        return text

    assert "projectiles.count: 16, must be 1 to 15" in said(projectiles={"count": 16})
    assert "projectiles.count: 0, must be 1 to 15" in said(projectiles={"count": 0})
    assert "projectiles.mass_kg: nan" in said(projectiles={"mass_kg": float("nan")})
    assert "projectiles.radius_m: 2.0, must be 0.02 to 0.3" in said(projectiles={"radius_m": 2.0})
    assert "projectiles.speed_m_s: 40.0, must be 1 to 20" in said(projectiles={"speed_m_s": 40.0})
    assert "displacement.shift_m: -1.0" in said(displacement={"shift_m": -1.0})
    assert "displacement: not together with moves" in said(
        displacement={"seed": 1}, moves=[{"at_s": 0.1, "position": [1, 0, 0]}]
    )
