"""Descriptions of served policies: features, actions, joints, gains, data and licence."""

from collections.abc import Iterable, Mapping
from functools import cache

import mujoco

from policy.checkpoints import lineage
from policy.checkpoints.served import ACTIONS, Served
from rpc.malformed import redact
from rpc.v1 import policy_pb2 as pb
from world.character import kinematics
from world.character import model as character
from world.character.features import STATE, Table

MEANING = (
    "Position servos at the control rate: target = clamp(offset + scale * "
    "clamp(action, -clip, clip), low, high), rad. A ball joint has three servos, which drive x, "
    "y and z of its rotation vector (the rotation of the body in its parent's frame); a hinge has "
    "one, which drives its angle. Torque = kp (target - position) - kd velocity, within the limit "
    "at each control step: between two of them only kp and kd act."
)


def features(table: Table) -> list[pb.Feature]:
    """Messages of a table of features, in order."""
    return [pb.Feature(name=f.name, width=f.width, frame=f.frame, unit=f.unit) for f in table]


def servos() -> list[pb.Servo]:
    """The 28 servos, in the order of the actions."""
    return [
        pb.Servo(
            name=joint.name + (f"_{'xyz'[axis]}" if joint.is_ball else ""),
            kp=joint.kp,
            kd=joint.kd,
            limit_nm=joint.limit_nm,
        )
        for joint in character.JOINTS
        for axis in range(len(joint.range_deg))
    ]


@cache
def bodies() -> tuple[pb.Body, ...]:
    """The 15 bodies, parents before their children."""
    return tuple(
        pb.Body(name=name, parent=parent, offset=offset)
        for name, parent, offset in zip(
            character.BODIES, character.PARENTS, kinematics.offsets().tolist(), strict=True
        )
    )


@cache
def joints() -> tuple[pb.Joint, ...]:
    """The 12 joints, in the order of positions and velocities."""
    model = character.spec().compile()
    found = []
    for body, joint in zip(character.JOINT_BODIES, character.JOINTS, strict=True):
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint.name)
        axis = [] if joint.is_ball else model.jnt_axis[index].tolist()
        kind = "ball" if joint.is_ball else "hinge"
        found.append(pb.Joint(name=joint.name, body=character.BODIES[body], kind=kind, axis=axis))
    return tuple(found)


@cache
def mjcf() -> str:
    """The character and its servos as a MuJoCo model."""
    spec = character.spec()
    spec.compile()
    return spec.to_xml()


def action(served: Served) -> pb.Action:
    """Meaning of an action's numbers."""
    ours = served.action_map
    return pb.Action(
        width=ACTIONS,
        meaning=MEANING,
        offset_rad=ours.offset.tolist(),
        scale_rad=ours.scale.tolist(),
        low_rad=ours.low.tolist(),
        high_rad=ours.high.tolist(),
        clip=ours.clip,
        sigma=served.sigma,
        servos=servos(),
    )


def training_data(notes: Mapping[str, str]) -> tuple[str, str]:
    """Training data and licence of the weights."""
    data = lineage.data(notes)
    if data == lineage.NOT_STATED:
        data = "motion clips of the run's configuration; not published with it"
    return data, lineage.licence(notes)


def policy(served: Served, reloads: int = 0, last_refusal: str = "") -> pb.PolicyDescription:
    """Description of one policy."""
    data, licence = training_data(served.manifest.notes)
    return pb.PolicyDescription(
        name=served.name,
        task=served.task.name,
        version=served.version,
        checkpoint=served.digest,
        iteration=served.manifest.iteration,
        samples=served.manifest.samples,
        state=features(STATE),
        goal=features(served.task.goal),
        action=action(served),
        training_data=data,
        licence=licence,
        evaluation=served.manifest.notes.get("evaluation", ""),
        reward_terms=[
            pb.RewardTerm(name=name, weight=weight) for name, weight in served.task.terms.items()
        ],
        success_m=served.task.success_m,
        reloads=reloads,
        last_refusal=redact(last_refusal),
    )


def everything(
    policies: Iterable[pb.PolicyDescription], limits: pb.Limits | None
) -> pb.DescribeReply:
    """Reply of Describe."""
    return pb.DescribeReply(
        policies=policies,
        bodies=bodies(),
        joints=joints(),
        control_hz=character.CONTROL_HZ,
        simulation_hz=1.0 / character.TIMESTEP_S,
        limits=limits,
        mjcf=mjcf(),
    )
