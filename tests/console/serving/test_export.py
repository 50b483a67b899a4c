"""ONNX export: the same actions in another runtime, by a model that describes itself."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from console.serving.export import ExportError, compare, export, model_of
from policy.checkpoints.served import Served
from policy.messages import description
from tests.support.policy_cases import WIDTH, make, observation

onnxruntime = pytest.importorskip("onnxruntime")
onnx = pytest.importorskip("onnx")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("onnx") / "sit.onnx"
    found = export(make(), out)
    assert max(found.action, found.target_rad) <= 1e-5
    return out


@pytest.mark.parametrize("rows", [1, 17])
def test_it_acts_as_the_policy_does(file: Path, rows: int) -> None:
    session = onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"])
    assert [i.name for i in session.get_inputs()] == ["state", "goal"]
    assert [(o.name, o.shape) for o in session.get_outputs()] == [
        ("action", ["n", 28]),
        ("target", ["n", 28]),
    ]
    parts = [np.frombuffer(part, "<f4").reshape(rows, -1) for part in observation(3, rows)]
    # far beyond what the normaliser clips, too
    parts[0] = 100.0 * parts[0]
    action, target = session.run(None, dict(zip(("state", "goal"), parts, strict=True)))
    served = make()
    wanted = served.policy(*(torch.from_numpy(part.copy()) for part in parts))
    np.testing.assert_allclose(action, wanted.numpy(), atol=1e-5)
    np.testing.assert_allclose(target, served.action_map.set_points(wanted).numpy(), atol=1e-5)


def test_it_acts_as_the_policy_does_with_a_linear_skip(tmp_path: Path) -> None:
    served = make(1, "carry", "carry")
    assert served.policy.actor.skip is not None
    found = export(served, tmp_path / "carry.onnx")
    assert max(found.action, found.target_rad) <= 1e-5


def test_it_matches_describe(file: Path) -> None:
    model = onnx.load(str(file))
    said = {entry.key: entry.value for entry in model.metadata_props}
    assert said["licence"] == "Apache-2.0" and said["version"] == make().version
    described = json.loads(said["describe"])["policies"][0]
    wanted = description.policy(make())
    assert [f["name"] for f in described["state"]] == [f.name for f in wanted.state]
    assert [s["kp"] for s in described["action"]["servos"]] == [s.kp for s in wanted.action.servos]


def test_a_difference_is_found_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = tmp_path / "other.onnx"
    other.write_bytes(model_of(make(1)))
    assert compare(make(), other).action > 0.01
    monkeypatch.setattr("console.serving.export.model_of", lambda served: other.read_bytes())
    with pytest.raises(ExportError, match="differ by"):
        export(make(), tmp_path / "sit.onnx")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["other.onnx"]
    with pytest.raises(ExportError, match="cannot write"):
        export(make(), tmp_path / "none" / "sit.onnx")


def test_the_widths_are_the_policys() -> None:
    served: Served = make()
    assert served.width == WIDTH
