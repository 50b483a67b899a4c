"""The box to carry, its initial stand and its target's stand: geometry, mass and contacts."""

import math

import mujoco

from world.furniture.piece import Box, Piece, Vector

#: A box whose centre is lower than this lies on the ground, m.
GROUND_M = 0.30
BOX_BODY, STAND_BODY = "box", "stand"
#: Edges of the default box, m (the paper's 50 × 35 × 30 cm): y, the long one, is between the hands,
#: z is up.
BOX_SIZE_M: Vector = (0.35, 0.50, 0.30)
#: Mass of the default box, kg; of others, by volume. Our value: the paper gives none.
BOX_KG = 4.0
#: Collision bits: the box collides with the character, the floor, the stands and projectiles.
_ALL = 3
_SOLID, _CHARACTER = 2, 1
#: contype and conaffinity of a stand that holds the box and lets everything else pass.
PASSABLE = 0, _SOLID
#: Contact with the box. Palms are wide and soft, the hands' spheres make point contacts: friction
#: 1.2 (skin or fabric on cardboard), and a torsional coefficient of two thirds of that over a patch
#: of 4 cm radius, so that a box between two hands does not swing about the line between them.
FRICTION, _TORSION_M, _ROLLING_M = 1.2, 0.032, 0.001
_CONDIM = 4
#: Ratio of friction to normal impedance, that of MuJoCo's models of hands. The friction of soft
#: contacts creeps under any load, by a speed inversely proportional to this: between palms that
#: press three times as hard as Coulomb's law asks 13.5 kg slip by 1.2 cm/s at 3, 0.36 cm/s at 10.
#: The cones are elliptic, although a control step then takes 1.4 times as long: with pyramidal ones
#: a box slips down in hands that shake with every walking step (docs/lab-notes/carry-teacher.md).
IMPRATIO = 10.0


def box(scale: float = 1.0, mass_kg: float | None = None) -> Piece:
    """The default box at `scale`, in a frame at its centre; mass_kg None: by volume."""
    x, y, z = (0.5 * scale * edge for edge in BOX_SIZE_M)
    mass = by_volume_kg((x, y, z)) if mass_kg is None else mass_kg
    return Piece("box", "box", (Box((0.0, 0.0, 0.0), (x, y, z)),), (), mass)


def by_volume_kg(half_m: Vector) -> float:
    """Mass by volume of a box with these half edges, m, in kg."""
    return 8.0 * BOX_KG * math.prod(half_m) / math.prod(BOX_SIZE_M)


def is_box(piece: Piece) -> bool:
    """Whether a piece is a box to carry, as `box` returns it."""
    return piece.category == BOX_BODY and len(piece.boxes) == 1


#: A plate on a column, in a frame at the centre of its top; the column extends below the floor, so
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


def add(spec: mujoco.MjSpec, cargo: Piece, passable: bool = False) -> None:
    """Add the target's stand, a mocap body, and the free box `cargo`, in this order.

    passable: the stand touches the box alone.
    """
    contype, conaffinity = PASSABLE if passable else (_SOLID, _CHARACTER)
    spec.option.impratio = IMPRATIO
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    # the solver dominates a step with elliptic cones, and a contact moves few joints: a sparse
    # Jacobian takes 0.73 of the time (bench box), for the same motion to the last bits
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    # a box that turns: its gyroscopic forces are implicit
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    stand = spec.worldbody.add_body(name=STAND_BODY, mocap=True)
    for part in STAND.boxes:
        stand.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=part.half_m,
            pos=part.centre_m,
            contype=contype,
            conaffinity=conaffinity,
            friction=[1.0, 0.05, 0.001],
            rgba=[0.45, 0.62, 0.45, 1.0],
        )
    add_free(spec, cargo, BOX_BODY)


def add_free(spec: mujoco.MjSpec, cargo: Piece, name: str) -> None:
    """Add the free box `cargo` as the body `name`."""
    body = spec.worldbody.add_body(name=name)
    body.add_freejoint(name=name)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=cargo.boxes[0].half_m,
        mass=cargo.mass_kg,
        contype=_ALL,
        conaffinity=_ALL,
        condim=_CONDIM,
        friction=[FRICTION, _TORSION_M, _ROLLING_M],
        rgba=[0.80, 0.62, 0.30, 1.0],
    )
