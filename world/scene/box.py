"""The box that is carried, the stand that it starts on and the one that it goes to: geometry,
weight and contacts."""

import mujoco

from world.furniture.piece import Box, Piece, Vector

#: A box whose centre is this low lies on the ground, m.
GROUND_M = 0.30
BOX_BODY, STAND_BODY = "box", "stand"
#: Edges of the default box, m (the paper's 50 × 35 × 30 cm): y, the long one, lies between the
#: hands of who carries it, z is up.
BOX_SIZE_M: Vector = (0.35, 0.50, 0.30)
#: Weight of the default box, kg; of others, by volume. Ours: the paper gives none.
BOX_KG = 4.0
#: Collision bits: the box meets the character, the floor, the stands and whatever is thrown.
_ALL = 3
_SOLID, _CHARACTER = 2, 1
#: Contact with the box. Palms are wide and give way, spheres are points: friction 1.2 (skin or
#: fabric on cardboard), and a torsional coefficient of two thirds of that over a patch of 4 cm
#: radius, so that a box held between two hands does not swing about the line between them.
FRICTION, _TORSION_M, _ROLLING_M = 1.2, 0.032, 0.001
_CONDIM = 4
#: Friction as stiff against slip as against penetration times this. Elliptic cones, though a
#: control step takes 1.4 times as long with them: between pyramidal ones a box creeps down in hands
#: that shake with every step, by 3 cm a second at a ratio of 30 (docs/lab-notes/carry-teacher.md).
IMPRATIO = 3.0


def box(scale: float = 1.0, mass_kg: float | None = None) -> Piece:
    """The default box at `scale`, in a frame at its centre; its mass by volume if not given."""
    x, y, z = (0.5 * scale * edge for edge in BOX_SIZE_M)
    mass = BOX_KG * scale**3 if mass_kg is None else mass_kg
    return Piece("box", "box", (Box((0.0, 0.0, 0.0), (x, y, z)),), (), mass)


def is_box(piece: Piece) -> bool:
    """Whether a piece is a box to be carried, as `box` makes them."""
    return piece.category == BOX_BODY and len(piece.boxes) == 1


#: A plate on a column, in a frame at the middle of its top; the column runs on below any floor, so
#: that the height of a stand is that of its frame.
STAND = Piece(
    "stand",
    "stand",
    (
        Box((0.0, 0.0, -0.015), (0.19, 0.19, 0.015)),
        Box((0.0, 0.0, -1.0), (0.05, 0.05, 0.99)),
    ),
    (),
    1.0,
)


def add(spec: mujoco.MjSpec, cargo: Piece) -> None:
    """Add the stand to put down on, a mocap body, and the free box `cargo`, in this order."""
    spec.option.impratio = IMPRATIO
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # the solver is most of a step with elliptic cones, and a contact moves few of the joints: 0.73
    # of the time that dense matrices take (bench box), for the same motion to the last bits
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    stand = spec.worldbody.add_body(name=STAND_BODY, mocap=True)
    for part in STAND.boxes:
        stand.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=part.half_m,
            pos=part.centre_m,
            contype=_SOLID,
            conaffinity=_CHARACTER,
            friction=[1.0, 0.05, 0.001],
            rgba=[0.45, 0.62, 0.45, 1.0],
        )
    body = spec.worldbody.add_body(name=BOX_BODY)
    body.add_freejoint(name=BOX_BODY)
    body.add_geom(
        name=BOX_BODY,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=cargo.boxes[0].half_m,
        mass=cargo.mass_kg,
        contype=_ALL,
        conaffinity=_ALL,
        condim=_CONDIM,
        friction=[FRICTION, _TORSION_M, _ROLLING_M],
        rgba=[0.80, 0.62, 0.30, 1.0],
    )
