"""MuJoCo models of one character, a floor and one piece of furniture in a fixed number of collision
slots.

Every model has the same layout, so that one Batch steps any mixture of pieces and a scene changes
its piece between episodes without a rebuild.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from world.character import model as character
from world.furniture.piece import Box, Piece
from world.scene import box as box_scene
from world.scene import slots
from world.scene.slots import Layout

FURNITURE_BODY = "furniture"
PROJECTILE_BODY = "projectile"
#: Collision bits: the character collides with what is solid; an unused slot collides with nothing,
#: but keeps its node in the body's bounding-volume tree, so that every piece has the same layout.
_SOLID, _CHARACTER = 2, 1
_FURNITURE_RGBA = [0.72, 0.53, 0.36, 1.0]
#: contype and conaffinity of solid furniture.
SOLID = _SOLID, _CHARACTER
#: The same of an unused slot.
UNUSED = 4, 4

_NOTHING = Piece("nothing", "none", (Box((0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3)),), (), 1.0)


@dataclass(frozen=True)
class Ball:
    """A projectile: a solid ball that is thrown at the character."""

    mass_kg: float = 1.2
    radius_m: float = 0.09


def compile_scene(
    piece: Piece | None,
    balls: Sequence[Ball] = (),
    cargo: Piece | None = None,
    shared: Layout | None = None,
    passable: bool = False,
    limited: bool = False,
) -> mujoco.MjModel:
    """The model of a scene with `piece` (None: an empty floor, all slots unused), a free box
    `cargo` with the stand of its target, and free `balls`, whose coordinates come last.

    The furniture is a mocap body: it is placed by mocap_pos and mocap_quat (piece frame: origin on
    the floor, z up, +x front) and adds no joint. `shared`: layout of all models of a batch, by
    default the one that this piece needs. `passable`: the piece and the stand touch the box alone.
    The servos have no force limits of their own: the limits are applied to their set-points
    (`world.character.servos`). `limited`: they have, for set-points that nothing limits.
    """
    return scene_spec(piece, balls, cargo, shared, passable, limited).compile()


def scene_spec(
    piece: Piece | None,
    balls: Sequence[Ball] = (),
    cargo: Piece | None = None,
    shared: Layout | None = None,
    passable: bool = False,
    limited: bool = False,
) -> mujoco.MjSpec:
    """What `compile_scene` compiles, to be added to."""
    spec = character.spec()
    for servo in spec.actuators:
        servo.ctrllimited, servo.forcelimited = False, limited
    if not limited:
        _damp_joints(spec)
    # Newton to 1e-5 instead of 1e-8 and one island: velocities after a control step agree to 2e-6,
    # and the step takes a fifth less time. A cap on the iterations would make hard contacts
    # unstable. A warm start saves no iteration with so few contacts (1.8 each without it, 2.2 with
    # it) and costs a tenth of the step.
    spec.option.tolerance = 1e-5
    spec.option.disableflags |= int(
        mujoco.mjtDisableBit.mjDSBL_ISLAND | mujoco.mjtDisableBit.mjDSBL_WARMSTART
    )
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        contype=_SOLID,
        conaffinity=_CHARACTER,
        friction=[1.0, 0.05, 0.001],
        rgba=[0.93, 0.93, 0.9, 1],
    )
    _add_furniture(spec, piece, shared or slots.common([piece or _NOTHING]), passable)
    if cargo is not None:
        box_scene.add(spec, cargo, passable)
    _add_balls(spec, balls)
    return spec


def _damp_joints(spec: mujoco.MjSpec) -> None:
    """Move the damping of the servos, which have no force limits, to their joints.

    The forces are the same, and implicit as before: a joint's own damping is implicit in Euler's
    method too, which has no derivatives of actuators to compute. Velocities after a control step
    agree to 1e-12 rad/s, and the step takes 0.94 of the time. A clamped servo clamps its damping as
    well, and a joint does not.
    """
    kp, _ = character.gains()
    for servo, stiffness in zip(spec.actuators, kp, strict=True):
        servo.set_to_position(kp=stiffness, kv=0.0)
    for joint in character.JOINTS:
        # the coefficients of a polynomial in the velocity
        spec.joint(joint.name).damping = [joint.kd, 0.0, 0.0]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER


def _add_balls(spec: mujoco.MjSpec, balls: Sequence[Ball]) -> None:
    """Add free balls."""
    for index, ball in enumerate(balls):
        thrown = spec.worldbody.add_body(name=f"{PROJECTILE_BODY}{index}")
        thrown.add_freejoint()
        thrown.add_geom(
            name=thrown.name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[ball.radius_m, 0, 0],
            mass=ball.mass_kg,
            contype=_CHARACTER,
            conaffinity=_CHARACTER,
            rgba=[0.80, 0.25, 0.20, 1.0],
        )


def compile_room(
    pieces: Sequence[Piece], boxes: Sequence[Piece], balls: Sequence[Ball] = ()
) -> tuple[mujoco.MjModel, mujoco.MjModel]:
    """The models of one room with several `pieces`, each a mocap body, and one or more free
    `boxes`: the first steps as scenes of furniture do, the second as scenes of a box. They have one
    layout, so that a scene may change between them.

    The first two mocap bodies are those of a scene with a box: the initial stand of the first box,
    and the stand of the target. The initial stands of the other boxes follow, then the pieces. The
    coordinates of the boxes follow the character's, in their order; those of balls come last.
    """
    spec = scene_spec(box_scene.STAND, (), boxes[0])
    for number, box in enumerate(boxes[1:], 1):
        box_scene.add_free(spec, box, f"{box_scene.BOX_BODY}{number}")
    _add_balls(spec, balls)
    for number, piece in enumerate((*[box_scene.STAND] * (len(boxes) - 1), *pieces)):
        _add_furniture(spec, piece, slots.exactly(piece), name=f"{FURNITURE_BODY}{number}")
    carrying = spec.compile()
    plain = scene_spec(None).option
    for name in ("impratio", "cone", "jacobian", "integrator"):
        setattr(spec.option, name, getattr(plain, name))
    return spec.compile(), carrying


def _add_furniture(
    spec: mujoco.MjSpec,
    piece: Piece | None,
    shared: Layout,
    passable: bool = False,
    name: str = FURNITURE_BODY,
) -> None:
    """Add the furniture's body `name`: hulls or boxes in the first slots, the others unused."""
    body = spec.worldbody.add_body(name=name, mocap=True)
    # geoms and meshes of the scene's own furniture have no prefix
    prefix = "" if name == FURNITURE_BODY else f"{name}."
    shown = piece or _NOTHING
    fillings = slots.fillings(shown, shared)
    centre, half, quat, used = shown.boxes_padded(shared.slots)
    if piece is None:
        used = np.zeros(shared.slots, dtype=bool)
    bits = box_scene.PASSABLE if passable else SOLID
    for slot in range(shared.slots):
        contype, conaffinity = bits if used[slot] else UNUSED
        geom = body.add_geom(
            name=f"{prefix}slot{slot}",
            contype=contype,
            conaffinity=conaffinity,
            friction=[1.0, 0.05, 0.001],
            rgba=_FURNITURE_RGBA if used[slot] else [*_FURNITURE_RGBA[:3], 0.0],
        )
        if slot < len(shown.hulls):
            slots.add_hull(spec, f"{prefix}hull{slot}", shown.hulls[slot])
            geom.type = mujoco.mjtGeom.mjGEOM_MESH
            geom.meshname = f"{prefix}hull{slot}"
        else:
            geom.type = mujoco.mjtGeom.mjGEOM_BOX
            geom.size, geom.pos, geom.quat = half[slot], centre[slot], quat[slot]
    for index, faces in enumerate(fillings):
        slots.add_filling(spec, f"{prefix}filling{index}", faces)


def add_boxes(spec: mujoco.MjSpec, boxes: Sequence[Box], first: int) -> None:
    """Add boxes to the furniture of a scene that is drawn, in slots numbered from `first`.

    They touch nothing: a scene that is stepped has its furniture in the slots of its layout.
    """
    body = spec.body(FURNITURE_BODY)
    for slot, box in enumerate(boxes, first):
        body.add_geom(
            name=f"slot{slot}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=box.half_m,
            pos=box.centre_m,
            quat=box.quat,
            contype=UNUSED[0],
            conaffinity=UNUSED[1],
            rgba=_FURNITURE_RGBA,
        )
