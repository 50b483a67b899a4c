"""The quantities of the formulas of features and goals, as numpy expressions.

The reference page "Features and goals" prints them, and a test evaluates that page with numpy
alone. They repeat `features.body` for implementations of the inputs in another language.
"""

from dataclasses import dataclass

from world.character import kinematics
from world.character import model as character


@dataclass(frozen=True)
class Quantity:
    """A named quantity of the formulas."""

    name: str
    meaning: str
    shape: str = ""
    unit: str = ""
    expression: str = ""
    """A numpy expression over quantities defined before it; empty: an input."""


CHARACTER = (
    Quantity("p", "position of the root (the pelvis)", "3", "m"),
    Quantity("q", "rotation of the root, unit quaternion w, x, y, z", "4"),
    Quantity("v", "linear velocity of the root, world axes", "3", "m/s"),
    Quantity("w", "angular velocity of the root, in the root's own axes", "3", "rad/s"),
    *(
        Quantity(
            f"{'Q' if joint.is_ball else 'a'}_{joint.name}",
            "rotation of the joint's body in its parent's frame, unit quaternion w, x, y, z"
            if joint.is_ball
            else "flexion of the hinge, positive when bent",
            "4" if joint.is_ball else "scalar",
            "" if joint.is_ball else "rad",
        )
        for joint in character.JOINTS
    ),
    *(
        Quantity(
            f"w_{joint.name}",
            "angular velocity of the joint's body relative to its parent, in the body's own axes"
            if joint.is_ball
            else "rate of the flexion",
            "3" if joint.is_ball else "scalar",
            "rad/s",
        )
        for joint in character.JOINTS
    ),
)

SCENE = (
    Quantity(
        "o",
        "origin of the object: of furniture the floor below the point of use (z = 0), of a box its"
        " centre",
        "3",
        "m",
    ),
    Quantity(
        "Q_o",
        "rotation of the object, unit quaternion w, x, y, z; furniture is turned about z, +x where"
        " its user faces",
        "4",
    ),
    Quantity(
        "c",
        "corners of the object's bounding box. A box: along the axes of Q_o. Furniture: along its"
        " own axes, numbered as Q_o sees them, to the nearest quarter turn. x changes slowest, z"
        " fastest, the low end comes first",
        "8, 3",
        "m",
    ),
    Quantity("u", "point of use on the furniture's surface: below the hip", "3", "m"),
    Quantity("h", "point on the surface below the head of a lying character (lie)", "3", "m"),
    Quantity("b_v", "linear velocity of the box (carry)", "3", "m/s"),
    Quantity("t", "where the centre of the box should be put (carry)", "3", "m"),
)


def definitions() -> tuple[Quantity, ...]:
    """The quantities besides inputs, ordered so that each depends on earlier ones alone."""
    return (*_HELPERS, *_bodies())


_HELPERS = (
    Quantity(
        "matrix",
        "rotation matrix of a unit quaternion w, x, y, z",
        expression=(
            "lambda q: np.array(["
            "[1 - 2 * (q[2]**2 + q[3]**2), 2 * (q[1]*q[2] - q[0]*q[3]),"
            " 2 * (q[1]*q[3] + q[0]*q[2])], "
            "[2 * (q[1]*q[2] + q[0]*q[3]), 1 - 2 * (q[1]**2 + q[3]**2),"
            " 2 * (q[2]*q[3] - q[0]*q[1])], "
            "[2 * (q[1]*q[3] - q[0]*q[2]), 2 * (q[2]*q[3] + q[0]*q[1]),"
            " 1 - 2 * (q[1]**2 + q[2]**2)]])"
        ),
    ),
    Quantity("R", "rotation of the root", "3, 3", expression="matrix(q)"),
    Quantity(
        "yaw",
        "heading of the root: its twist about z",
        "scalar",
        "rad",
        "2 * np.arctan2(q[3], q[0])",
    ),
    Quantity(
        "H",
        "world axes to the heading frame",
        "3, 3",
        expression=(
            "np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])"
        ),
    ),
    Quantity(
        "six",
        "the x and z axes of a rotation matrix, one after the other",
        expression="lambda m: np.concatenate((m[:, 0], m[:, 2]))",
    ),
    Quantity("O", "rotation of the object", "3, 3", expression="matrix(Q_o)"),
    Quantity(
        "compressed",
        "an offset whose horizontal length r > 1.5 m becomes 1.5 (1 + ln(r / 1.5))",
        expression=(
            "lambda x: x * np.array([1, 1, 0]) * (1 if np.hypot(x[0], x[1]) <= 1.5 else "
            "1.5 * (1 + np.log(np.hypot(x[0], x[1]) / 1.5)) / np.hypot(x[0], x[1])) "
            "+ x * np.array([0, 0, 1])"
        ),
    ),
    Quantity(
        "near",
        "an offset that fades to 0 beyond 0.5 m",
        expression="lambda x: x * np.exp(-np.sum(np.square(x)) / 0.5**2)",
    ),
    Quantity("e", "half the extents of a box", "3", "m", "np.abs((c - o) @ O).max(axis=0)"),
    Quantity(
        "to_box",
        "from a point to the nearest point of a box",
        expression=("lambda x: O @ (np.clip(O.T @ (x - o), -e, e) - O.T @ (x - o))"),
    ),
    Quantity(
        "hinge",
        "rotation matrix about y by an angle",
        expression=(
            "lambda a: np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])"
        ),
    ),
)


def _bodies() -> list[Quantity]:
    """Forward kinematics, body by body: R_BODY and P_BODY, without leaves that no formula uses."""
    offsets = kinematics.offsets().tolist()
    joints: dict[int, character.Joint] = dict(
        zip(character.JOINT_BODIES, character.JOINTS, strict=True)
    )
    signs = iter(character.HINGE_SIGN)
    hinge_sign = {j.name: next(signs) for j in character.JOINTS if not j.is_ball}
    found = [
        Quantity("R_pelvis", "rotation of the pelvis", "3, 3", expression="R"),
        Quantity("P_pelvis", "position of the pelvis", "3", "m", "p"),
    ]
    for body, (name, parent) in enumerate(zip(character.BODIES, character.PARENTS, strict=True)):
        if parent < 0:
            continue
        above, joint = character.BODIES[parent], joints.get(body)
        turn = f"R_{above}"
        if joint is not None:
            own = (
                f"matrix(Q_{joint.name})"
                if joint.is_ball
                else f"hinge({'-' if hinge_sign[joint.name] < 0 else ''}a_{joint.name})"
            )
            turn = f"R_{above} @ {own}"
        offset = ", ".join(f"{x:.7g}" for x in offsets[body])
        found += [
            Quantity(f"R_{name}", "rotation of the body", "3, 3", expression=turn),
            Quantity(
                f"P_{name}",
                "position of the body",
                "3",
                "m",
                f"P_{above} + R_{above} @ np.array([{offset}])",
            ),
        ]
    return found
