"""Synthesis over loopback: the simulator's own frames, disturbances, every task, refusals."""

from collections.abc import Iterator

import grpc
import mujoco
import numpy as np
import pytest
import torch

from policy.synthesis.simulation import body_rotations
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import Running, chair, fixed, make, pose, refusal, running, stub
from world import tasks
from world.character import model as character
from world.config import CarryConfig
from world.furniture.catalogue import find
from world.objects.box_bank import BoxBank, resting
from world.objects.box_bank import boxes as training_boxes
from world.objects.furniture_bank import FurnitureBank
from world.scene.batch import Scenes
from world.scene.box import BOX_SIZE_M
from world.scene.target import state as state_of


@pytest.fixture(scope="module")
def server() -> Iterator[Running]:
    served = [make(), make(1, "lie", "lie"), make(2, "carry", "carry")]
    with running([fixed(one) for one in served]) as found:
        yield found


def synthesised(
    server: Running, request: pb.SynthesizeRequest
) -> tuple[pb.SynthesisHeader, list[pb.Frame], pb.SynthesisSummary]:
    """Header, frames and summary of a request."""
    with stub(server) as client:
        parts = list(client.Synthesize(request, timeout=60))
    assert parts[0].WhichOneof("part") == "header" and parts[-1].WhichOneof("part") == "summary"
    return parts[0].header, [part.frame for part in parts[1:-1]], parts[-1].summary


def by_hand(seconds: float) -> np.ndarray:
    """Root positions [T + 1, 3] of the sit policy, stepped by the bank and the scenes alone."""
    served = make()
    bank = FurnitureBank([find("chair-test-000")])
    scenes = Scenes(bank.models, served.world.action_scale, served.world.action_clip)
    here, facing = torch.tensor([0]), bank.facing
    point = torch.tensor([[2.0, 0.0]]) + bank.point[:, :2]
    place = bank.target(here, point, facing)
    qpos = character.standing_qpos()
    qpos[2] += 0.002
    scenes.set_state(
        here, torch.from_numpy(qpos)[None], torch.zeros(1, 34), *bank.placed(here, point, facing)
    )
    found = [scenes.qpos[0, :3].numpy().copy()]
    for _ in range(round(seconds * 30)):
        body = scenes.body()
        scenes.act(
            served.policy(state_of(body, place), tasks.make("sit").goal_features(body, place))
        )
        found.append(scenes.qpos[0, :3].numpy().copy())
    return np.stack(found)


def test_frames_are_the_simulators(server: Running) -> None:
    request = pb.SynthesizeRequest(
        task="sit", furniture=chair(), seconds=0.5, to_the_end=True, bodies=True
    )
    header, frames, summary = synthesised(server, request)
    assert len(frames) == summary.frames == 16
    np.testing.assert_allclose([f.time_s for f in frames], np.arange(16) / 30, atol=1e-9)
    roots = np.array([f.root_position for f in frames])
    np.testing.assert_allclose(roots, by_hand(0.5), atol=1e-4)
    assert list(header.reward_terms) == list(tasks.make("sit").terms) and not header.style
    weights = np.array(list(tasks.make("sit").terms.values()))
    for frame in frames:
        assert frame.reward == pytest.approx(float(np.dot(weights, frame.reward_terms)), abs=1e-5)
        assert not frame.HasField("style_score")
        np.testing.assert_allclose(frame.object_position, [2.0, 0.0, 0.0])
    # the bodies' poses are MuJoCo's own kinematics of the same coordinates
    model = character.spec().compile()
    data = mujoco.MjData(model)
    last = frames[-1]
    data.qpos[:] = [*last.root_position, *last.root_rotation, *last.joint_position]
    mujoco.mj_kinematics(model, data)
    np.testing.assert_allclose(
        np.array(last.body_position).reshape(15, 3), data.xpos[1:], atol=1e-5
    )
    ours = np.array(last.body_rotation).reshape(15, 4)
    assert np.abs((ours * data.xquat[1:]).sum(1)).min() == pytest.approx(1.0, abs=1e-5)
    assert [b.name for b in header.bodies] == list(character.BODIES)


def test_body_rotations_are_unit(server: Running) -> None:
    qpos = torch.from_numpy(character.standing_qpos())[None].float()
    assert torch.allclose(body_rotations(qpos).norm(dim=-1), torch.ones(1, 15))


def test_the_seed_is_the_motion(server: Running) -> None:
    def final(**more: int) -> list[float]:
        request = pb.SynthesizeRequest(task="sit", furniture=chair(), seconds=0.5, **more)
        return list(synthesised(server, request)[1][-1].joint_position)

    assert final() == final() and final(seed=1) == final(seed=1)
    assert final(seed=1) != final(seed=2) and final(seed=1) != final()


def test_pushes_push_and_moves_move(server: Running) -> None:
    request = pb.SynthesizeRequest(task="sit", furniture=chair(), seconds=0.5, to_the_end=True)
    calm = synthesised(server, request)[1]
    request.pushes.add(at_s=0.2, seconds=0.1, body="torso", force=[0.0, 500.0, 0.0])
    request.moves.add(at_s=0.3, position=[0.0, 3.0, 0.0], rotation=[1.0, 0.0, 0.0, 0.0])
    pushed = synthesised(server, request)[1]
    # nothing before, momentum after: 500 N for 0.1 s on 49 kg are about 1 m/s
    assert list(calm[6].joint_position) == list(pushed[6].joint_position)
    sideways = pushed[12].root_position[1] - calm[12].root_position[1]
    assert 0.01 < sideways < 0.4
    assert list(pushed[9].object_position) == [2.0, 0.0, 0.0]
    assert list(pushed[10].object_position) == [0.0, 3.0, 0.0]
    assert pushed[10].error_m != pytest.approx(pushed[9].error_m, abs=0.1)


def test_a_fall_ends_it(server: Running) -> None:
    lying = pose()
    lying.root_position[2] = 0.15
    lying.root_rotation[:] = [0.70710678, 0.0, 0.70710678, 0.0]
    request = pb.SynthesizeRequest(task="sit", furniture=chair(5.0), start=pb.Start(pose=lying))
    _, frames, summary = synthesised(server, request)
    assert summary.fell and frames[-1].fell and len(frames) == 1
    assert summary.success_s == -1 and summary.precision_m == -1


def test_a_fall_on_the_way_is_in_the_summary_though_it_goes_on(server: Running) -> None:
    """To the end: upright again, a character has fallen all the same."""
    request = pb.SynthesizeRequest(task="sit", furniture=chair(5.0), seconds=0.5, to_the_end=True)
    low = pose()
    low.root_position[2] = 0.3  # falls at once, and is thrown up by the floor it stands in
    request.start.pose.CopyFrom(low)
    request.pushes.add(at_s=0.1, seconds=0.3, body="pelvis", force=[0.0, 0.0, 2500.0])
    _, frames, summary = synthesised(server, request)
    assert [frame.fell for frame in frames[:1]] == [True] and not frames[-1].fell
    assert summary.fell and not summary.success


def test_lying_has_its_place(server: Running) -> None:
    request = pb.SynthesizeRequest(
        task="lie",
        furniture=pb.Furniture(
            piece="bed-test-000", position=[3.0, 0.0, 0.0], rotation=[1, 0, 0, 0]
        ),
        seconds=0.2,
    )
    header, frames, _ = synthesised(server, request)
    assert list(header.reward_terms) == list(tasks.make("lie").terms)
    assert 1.0 < frames[0].error_m < 5.0
    request.furniture.piece = "high-stool-test-000"
    with stub(server) as client:
        assert "has no place to lie" in refusal(client.Synthesize(request))[1]
        request.furniture.piece, request.furniture.place = "bed-test-000", 7
        assert "furniture.place: 7, must be 0 to" in refusal(client.Synthesize(request))[1]


def carried(**more: object) -> pb.CarriedBox:
    here = {
        "position": [1.5, 0.0, 0.9], "rotation": [1.0, 0.0, 0.0, 0.0], "velocity": [0.0] * 3,
        "size": BOX_SIZE_M, "start": [1.5, 0.0, 0.9], "goal": [3.0, 1.0, 0.8],
    }  # fmt: skip
    return pb.CarriedBox(**(here | more))  # pyright: ignore


def test_a_box_stands_on_its_stand(server: Running) -> None:
    request = pb.SynthesizeRequest(task="carry", box=carried(), seconds=0.5, to_the_end=True)
    header, frames, _ = synthesised(server, request)
    distance = float(np.linalg.norm(np.array([3.0, 1.0, 0.8]) - [1.5, 0.0, 0.9]))
    assert frames[0].error_m == pytest.approx(distance, abs=1e-5)
    np.testing.assert_allclose(frames[-1].object_position, [1.5, 0.0, 0.9], atol=0.01)
    np.testing.assert_allclose(header.boxes[0].half, np.array(BOX_SIZE_M) / 2, rtol=1e-6)
    with stub(server) as client:
        nothing = pb.SynthesizeRequest(task="carry", furniture=chair())
        assert "box: missing, 'carry' needs it" in refusal(client.Synthesize(nothing))[1]
        low = pb.SynthesizeRequest(task="carry", box=carried(goal=[3.0, 1.0, 0.1]))
        assert "box.goal[2]: 0.100" in refusal(client.Synthesize(low))[1]


def test_a_box_is_observed_as_in_training(server: Running) -> None:
    bank = BoxBank(training_boxes(CarryConfig())[:1])
    half = bank.half[0]
    where = (
        torch.tensor([[1.0, 0.5, 1.0]]),
        torch.tensor([[0.6, 0.8]]),
        torch.tensor([[3.0, 0, 0.8]]),
    )
    layout = resting(*where)
    qpos = torch.from_numpy(character.standing_qpos()).float()[None]
    from world.character import features

    body = features.body(qpos, torch.zeros(1, 34))
    place = bank.target(torch.tensor([0]), layout)
    state = state_of(body, place)
    goal = tasks.make("carry").goal_features(body, place)
    box = carried(
        position=where[0][0].tolist(), rotation=layout.rotation[0].tolist(),
        size=(2 * half).tolist(), start=where[0][0].tolist(), goal=where[2][0].tolist(),
    )  # fmt: skip
    with stub(server) as client:
        raw = client.Act(
            pb.ActRequest(task="carry", state=state.numpy().tobytes(), goal=goal.numpy().tobytes())
        )
        posed = client.ActFromPose(
            pb.ActFromPoseRequest(task="carry", situations=[pb.Situation(pose=pose(), box=box)])
        )
    ours, theirs = (np.frombuffer(reply.action, "<f4") for reply in (raw, posed))
    np.testing.assert_allclose(ours, theirs, atol=2e-4)


def test_what_cannot_be_simulated_is_named(server: Running) -> None:
    def said(**more: object) -> str:
        request = pb.SynthesizeRequest(**({"task": "sit", "furniture": chair()} | more))  # pyright: ignore
        with stub(server) as client:
            code, text = refusal(client.Synthesize(request, timeout=60))
        assert code is grpc.StatusCode.INVALID_ARGUMENT
        return text

    force = {"at_s": 0.0, "seconds": 1.0, "body": "torso", "force": [0.0, 0.0, 0.0]}
    assert "seconds: 1000000.0, must be" in said(seconds=1e6)
    assert "pushes[0].body: 'tail', must be one of pelvis" in said(
        pushes=[force | {"body": "tail"}]
    )
    assert "pushes[0].force[2]: 1000000.0" in said(pushes=[force | {"force": [0.0, 0.0, 1e6]}])
    assert "furniture: missing" in said(furniture=None)
    custom = pb.Furniture(custom=pb.Shape(hip=[0.0, 0.0, 0.4], boxes=[pb.SolidBox()]))
    assert "boxes[0].half: 0 numbers, must be 3" in said(furniture=custom)
    many = [pb.SolidBox(centre=[0.0, 0.0, 0.2], half=[0.2, 0.2, 0.2])] * 200
    custom.custom.ClearField("boxes")
    custom.custom.boxes.extend(many)
    assert "furniture.custom.boxes: 200, must be at most 64" in said(furniture=custom)
    mesh = pb.Furniture(mesh=pb.Mesh(format="fbx", data=b"x"))
    assert "furniture.mesh.format: 'fbx', must be one of obj" in said(furniture=mesh)


def test_a_mesh_becomes_furniture(
    server: Running, tmp_path_factory: pytest.TempPathFactory
) -> None:
    trimesh = pytest.importorskip("trimesh")
    seat = trimesh.creation.box((0.45, 0.45, 0.08))
    seat.apply_translation((0.0, 0.0, 0.42))
    back = trimesh.creation.box((0.06, 0.45, 0.5))
    back.apply_translation((-0.2, 0.0, 0.7))
    legs = trimesh.creation.box((0.3, 0.3, 0.4))
    legs.apply_translation((0.0, 0.0, 0.2))
    stl = trimesh.util.concatenate([seat, back, legs]).export(file_type="stl")
    mesh = pb.Furniture(mesh=pb.Mesh(format="stl", data=stl))
    request = pb.SynthesizeRequest(
        task="sit", furniture=mesh, seconds=0.1, start=pb.Start(standing=pb.Stance(x=2.0))
    )
    header, frames, _ = synthesised(server, request)
    assert header.boxes and 1.0 < frames[0].error_m < 3.0
    broken = pb.Furniture(mesh=pb.Mesh(format="stl", data=b"not a mesh"))
    with stub(server) as client:
        request.furniture.CopyFrom(broken)
        code, said = refusal(client.Synthesize(request, timeout=60))
        assert code is grpc.StatusCode.INVALID_ARGUMENT and "furniture.mesh:" in said
