"""`inhabit export` of a policy: ONNX, with its normaliser, compared with the original.

Inputs `state` [n, 114] and `goal` [n, G], outputs `action` [n, 28] and `target` [n, 28] (servo
set-points, rad), float32; the metadata holds the description of the policy service as JSON.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from google.protobuf import json_format
from numpy.typing import NDArray

from console import outputs
from console.commands import Export
from console.serving import loading
from console.terminal import doing
from policy.checkpoints.served import ACTIONS, STATE_WIDTH, Served
from policy.messages import description
from policy.model.networks import hidden_widths
from world.errors import InhabitError
from world.partial_files import replacing

OPSET = 17
TOLERANCE = 1e-3
"""Largest deviation of an action or set-point, as a fraction of the action noise in training.

Float32 sums in another order differ in the last digits: by 1e-5 for outputs of size 1. What matters
is how the deviation compares with the noise under which the policy was trained.
"""
LEAST_NOISE = 0.01
"""Action noise that a policy trained with less, or with an unknown one, is compared with."""
#: Rows of the comparison.
ROWS = 4096
EXTRA = "export needs the packages onnx and onnxruntime: pip install 'inhabit[export]'"


class ExportError(InhabitError):
    """A policy that cannot be exported, or an export with different actions."""


@dataclass(frozen=True)
class Difference:
    """Largest absolute differences between the outputs of ONNX Runtime and of the policy."""

    action: float
    target_rad: float
    of_noise: float
    """The larger of the two as a fraction of the action noise, in actions and in set-points."""


def export_policy(command: Export) -> int:
    """Export, compare and write the file; return the exit code."""
    outputs.check(command.out, "FILE.onnx", (".onnx",))
    path = loading.checkpoint_of(command.source, command.checkpoint)
    served = loading.served(loading.task_of(path), path).check()
    with doing("comparing the exported actions with the policy's"):
        found = export(served, command.out)
    size = command.out.stat().st_size / 1e6
    print(
        f"{command.out}: {served.task.name} {served.version}, {size:.1f} MB; over {ROWS} states"
        f" ONNX Runtime deviates by at most {found.action:.1e} in an action"
        f" ({found.target_rad:.1e} rad in a set-point), {100 * found.of_noise:.2g} % of the noise"
        f" of {noise_of(served):.2g} in training; {100 * TOLERANCE:g} % is allowed"
    )
    return 0


def export(served: Served, out: Path) -> Difference:
    """Write a policy as ONNX; ExportError, and no file, for a deviation beyond TOLERANCE of the
    noise."""
    try:
        with replacing(out) as partial:
            partial.write_bytes(model_of(served))
            found = compare(served, partial)
            if not found.of_noise <= TOLERANCE:
                raise ExportError(
                    f"ONNX Runtime gives actions that differ by up to {found.action:.1e},"
                    f" {100 * found.of_noise:.2g} % of the noise of {noise_of(served):.2g} in"
                    f" training; at most {100 * TOLERANCE:g} % is allowed: nothing was written"
                )
    except OSError as error:
        raise ExportError(f"cannot write {out}: {error.strerror}") from error
    return found


def model_of(served: Served) -> bytes:
    """Return the ONNX model: mirroring, for a policy of one side alone; normalisation, clipping,
    the perceptron with its skip connection, and the set-points."""
    try:
        from onnx import TensorProto, checker, helper, numpy_helper
    except ImportError as error:
        raise ExportError(EXTRA) from error
    policy, meaning = served.policy, served.action_map
    weights = {name: tensor.float().numpy() for name, tensor in policy.actor.state_dict().items()}
    constants: dict[str, NDArray[np.float32]] = {
        "mean": policy.mean.numpy(),
        "std": policy.std.numpy(),
        "clip_low": _scalar(-policy.clip),
        "clip_high": _scalar(policy.clip),
        "action_low": _scalar(-meaning.clip),
        "action_high": _scalar(meaning.clip),
        **{name: getattr(meaning, name).numpy() for name in ("offset", "scale", "low", "high")},
    }
    indices: dict[str, NDArray[np.int64]] = {}
    nodes = [helper.make_node("Concat", ["state", "goal"], ["observation"], axis=1)]
    observed, output = "observation", "action"
    if policy.symmetry is not None and policy.symmetry.sides is not None:
        observed, output = "mirrored_observation", "mirrored_action"
        for name, value in policy.symmetry.tensors().items():
            whole = not value.is_floating_point()
            (indices if whole else constants)[name] = value.numpy()
        parts = ["x", "y", "second_x", "second_y"]
        constants["nothing"] = np.zeros(1, np.float32)
        nodes += [
            helper.make_node("Gather", ["observation", "sides"], ["directions"], axis=1),
            helper.make_node("Split", ["directions"], parts, axis=1),
            helper.make_node("Mul", ["x", "second_y"], ["to_left"]),
            helper.make_node("Mul", ["y", "second_x"], ["to_right"]),
            helper.make_node("Sub", ["to_left", "to_right"], ["side"]),
            helper.make_node("Less", ["side", "nothing"], ["right"]),
            *_mirrored("observation", "observation", observed),
        ]
    nodes += [
        helper.make_node("Sub", [observed, "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "std"], ["scaled"]),
        helper.make_node("Clip", ["scaled", "clip_low", "clip_high"], ["x0"]),
    ]
    skip = weights.pop("skip.weight", None)
    layers = sorted({int(name.split(".")[1]) for name in weights})
    for number, layer in enumerate(layers):
        last = layer == layers[-1]
        for part in ("weight", "bias"):
            constants[f"{part}{number}"] = weights[f"layers.{layer}.{part}"]
        out = f"y{number}" if skip is not None or not last else output
        inputs = [f"x{number}", f"weight{number}", f"bias{number}"]
        nodes.append(helper.make_node("Gemm", inputs, [out], transB=1))
        if not last:
            nodes.append(helper.make_node("Relu", [out], [f"x{number + 1}"]))
    if skip is not None:
        constants["skip"] = skip
        nonlinear = f"y{len(layers) - 1}"
        nodes.append(helper.make_node("Gemm", ["x0", "skip", nonlinear], [output], transB=1))
    if output != "action":
        nodes += _mirrored("action", output, "action")
    nodes += [
        helper.make_node("Clip", ["action", "action_low", "action_high"], ["clipped"]),
        helper.make_node("Mul", ["clipped", "scale"], ["moved"]),
        helper.make_node("Add", ["moved", "offset"], ["set_point"]),
        helper.make_node("Min", ["set_point", "high"], ["below"]),
        helper.make_node("Max", ["below", "low"], ["target"]),
    ]

    def rows(name: str, width: int) -> Any:
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])

    graph = helper.make_graph(
        nodes,
        served.name,
        [rows("state", STATE_WIDTH), rows("goal", served.width - STATE_WIDTH)],
        [rows("action", ACTIONS), rows("target", ACTIONS)],
        [
            numpy_helper.from_array(np.ascontiguousarray(value, dtype=np.float32), name)
            for name, value in constants.items()
        ]
        + [numpy_helper.from_array(value, name) for name, value in indices.items()],
    )
    model = helper.make_model(
        graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="inhabit"
    )
    model.ir_version = 10  # supported by runtimes of the last years
    helper.set_model_props(model, metadata(served))
    checker.check_model(model, full_check=True)
    return model.SerializeToString()


def _mirrored(what: str, given: str, out: str) -> list[Any]:
    """Return nodes that compute `out`: the mirror image of `given`, an observation or an action,
    where `right` is true."""
    from onnx import helper

    return [
        helper.make_node("Gather", [given, f"{what}_index"], [f"{what}_swapped"], axis=1),
        helper.make_node("Mul", [f"{what}_swapped", f"{what}_sign"], [f"{what}_image"]),
        helper.make_node("Where", ["right", f"{what}_image", given], [out]),
    ]


def metadata(served: Served) -> dict[str, str]:
    """Return the description of the policy service as JSON, and its main entries as text."""
    found = description.policy(served)
    everything = description.everything([found], limits=None)
    return {
        "describe": json_format.MessageToJson(everything, preserving_proto_field_name=True),
        "task": served.task.name,
        "version": served.version,
        "checkpoint": served.digest,
        "training_data": found.training_data,
        "licence": found.licence,
        "hidden": ",".join(map(str, hidden_widths(dict(served.policy.actor.state_dict()))[2])),
    }


def compare(served: Served, file: Path) -> Difference:
    """Compare ONNX Runtime with the policy in float32, on observations drawn from the normaliser's
    distribution, twice as wide."""
    try:
        import onnxruntime
    except ImportError as error:
        raise ExportError(EXTRA) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(file), options, ["CPUExecutionProvider"])
    draw = torch.Generator().manual_seed(0)
    policy = served.policy
    spread = 2.0 * torch.randn(ROWS, served.width, generator=draw)
    observation = policy.mean + policy.std * spread
    state, goal = (
        part.contiguous().numpy()
        for part in observation.split([STATE_WIDTH, served.width - STATE_WIDTH], dim=1)
    )
    action, target = session.run(["action", "target"], {"state": state, "goal": goal})
    own = policy(*observation.split([STATE_WIDTH, served.width - STATE_WIDTH], dim=1))
    set_points = served.action_map.set_points(own)
    of_action = np.abs(np.asarray(action) - own.numpy())
    of_target = np.abs(np.asarray(target) - set_points.numpy())
    noise = noise_of(served)
    in_target = noise * np.abs(served.action_map.scale.numpy())
    worst = max(of_action.max() / noise, (of_target / in_target).max())
    return Difference(float(of_action.max()), float(of_target.max()), float(worst))


def noise_of(served: Served) -> float:
    """Return the standard deviation of the action noise that deviations are compared with."""
    return max(served.sigma, LEAST_NOISE)


def _scalar(value: float) -> NDArray[np.float32]:
    return np.array(value, dtype=np.float32)
