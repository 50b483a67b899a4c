"""Motions of the character on another skeleton: the inverse of an import.

The bones keep their lengths. Trunk, head, arms and feet turn as ours do; legs bend so that the
ankles are where ours are, scaled by the length of the legs, as is the travel: a standing foot
stands. What has no part of ours keeps its rest pose relative to the joint above it.
"""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from console.animation.rig import Rig, RigError
from console.animation.skeleton import Y_UP, Array, Skeleton
from world.character import kinematics
from world.character import model as character
from world.motions.clip import Clip
from world.motions.formats.landmarks import SIDES
from world.motions.formats.recording import forward
from world.motions.retarget.body import ANKLE_M, LEG_M

#: Our body of each part of a rig, and the part at the far end of its bone.
_BONES = {
    f"{side}_{part}": (f"{side}_{body}", f"{side}_{end}")
    for side in SIDES
    for part, body, end in (
        ("hip", "thigh", "knee"),
        ("knee", "shin", "ankle"),
        ("shoulder", "upper_arm", "elbow"),
        ("elbow", "lower_arm", "wrist"),
    )
}
#: Our bones hang at rest.
_DOWN = np.array([0.0, 0.0, -1.0])
#: Least cosine of what is upright.
_UPRIGHT = 0.8
#: A rig whose ankles at rest are between 0 and this fraction of its legs above 0 stands on it.
_STANDS = 0.25
#: Height of a toe joint above the sole, and least and greatest height of an ankle, at our size, m,
#: as an import assumes.
_TOE_M, _ANKLES_M = 0.02, (0.06, 0.12)
#: Feet whose toes are nearer than this fraction of the leg ahead of the ankle have no heading.
_FOOT = 0.03


@dataclass(frozen=True)
class Fitted:
    """A motion on a rig."""

    rig: Rig
    """The rig, upright at rest."""
    skeleton: Skeleton
    """In the axes and unit of the rig's file."""
    hips: int
    """The joint that travels, at the root of trunk and legs."""
    hips_position: Array
    """[T, 3]: its place in the file's world."""
    scale: float
    """Length of the rig's leg, in its unit, over that of ours, m."""


def onto(clip: Clip, rig: Rig, parts: dict[str, int], axes: Array | None = None) -> Fitted:
    """Return a clip's motion on a rig.

    parts: the rig's joint of each part of the body. axes: from our world to the file's; None: z up
    stays z up, else y up and z forward. Raises RigError for a rig without a person's shape.
    """
    rig = standing(rig, parts)
    up, body = _alignment(rig, parts)
    if axes is None:
        axes = np.eye(3) if up == 2 else Y_UP
    place, rotation = _bodies(clip)
    pelvis, chest = _common(rig, parts, "hip"), _common(rig, parts, "shoulder")
    hips = _lowest(rig, pelvis, chest)
    turns = _mapped(rig, parts, body, (pelvis, hips), chest)
    frames = clip.frames
    delta = np.empty((frames, len(rig.names), 3, 3))
    trunk = _between(rig, (hips, chest, parts["head"]))
    for joint, parent in enumerate(rig.parents):
        if joint in turns:
            ours, own = turns[joint]
            delta[:, joint] = axes @ rotation[:, ours] @ own
        else:
            # what is above the hips stays as it is at rest
            delta[:, joint] = delta[:, parent] if parent >= 0 else np.eye(3)
    scale = _leg(rig, parts) / LEG_M
    _bend_legs(rig, parts, scale * place @ axes.T, axes @ rotation, delta)
    for low, joint, high, fraction in trunk:
        if joint not in turns:
            delta[:, joint] = _part_way(delta[:, low], delta[:, high], fraction)
    _follow(rig, turns, {joint for _, joint, _, _ in trunk}, delta)
    world = delta @ rig.rotation
    local = np.empty_like(world)
    offsets = rig.position.copy()
    for joint, parent in enumerate(rig.parents):
        local[:, joint] = world[:, joint]
        if parent >= 0:
            local[:, joint] = np.swapaxes(world[:, parent], -1, -2) @ world[:, joint]
            offsets[joint] = rig.rotation[parent].T @ (rig.position[joint] - rig.position[parent])
    at = _travel(clip, rig, parts, up, axes, hips, delta[:, hips], scale)
    root = at - (rig.position[hips] - rig.position[_top(rig, hips)])
    skeleton = Skeleton(
        names=rig.names,
        parents=rig.parents,
        offsets=offsets,
        local=local,
        moves={_top(rig, hips): root},
        fps=clip.fps,
        orders=rig.orders,
    )
    return Fitted(rig, skeleton, hips, at, scale)


def standing(rig: Rig, parts: dict[str, int]) -> Rig:
    """Return a rig whose rest is upright: its own, else the most upright frame of its motion.

    Motion capture is often written on a skeleton whose zero pose nobody could take. Raises RigError
    where it is upright nowhere.
    """
    if _uprightness(rig.position, parts) > _UPRIGHT:
        return rig
    if rig.motion is not None:
        position, rotation = rig.motion
        scores = [_uprightness(frame, parts) for frame in position]
        best = int(np.argmax(scores))
        if scores[best] > _UPRIGHT:
            return replace(rig, position=position[best], rotation=rotation[best])
    raise RigError(
        f"--rig {rig.name}: it does not stand at rest, nor in a frame of its motion: save it in a"
        " T- or A-pose, with +y or +z upwards"
    )


def _uprightness(position: Array, parts: dict[str, int]) -> float:
    """Return the least cosine, 1 for a straight stand, between the upward axis and trunk, thighs
    and shins, and between the lines of hips and shoulders, of joints [J, 3]."""

    def at(part: str) -> Array:
        return position[parts[part]]

    def cosine(a: Array, b: Array) -> float:
        return float(a @ b / max(np.linalg.norm(a) * np.linalg.norm(b), 1e-12))

    hips, shoulders = (at(f"left_{part}") - at(f"right_{part}") for part in ("hip", "shoulder"))
    middle = 0.5 * (at("left_hip") + at("right_hip"))
    trunk = 0.5 * (at("left_shoulder") + at("right_shoulder")) - middle
    tall = at("head") - 0.5 * (at("left_ankle") + at("right_ankle"))
    axis = int(np.argmax(np.abs(tall)))
    if axis == 0 or tall[axis] <= 0:
        return -1.0
    up = np.eye(3)[axis]
    legs = [
        cosine(at(f"{side}_{upper}") - at(f"{side}_{lower}"), up)
        for side in SIDES
        for upper, lower in (("hip", "knee"), ("knee", "ankle"))
    ]
    return min(cosine(trunk, up), cosine(hips, shoulders), *legs)


def _bodies(clip: Clip) -> tuple[Array, Array]:
    """Positions [T, 15, 3] m and rotations [T, 15, 3, 3] of our bodies in the world."""
    quaternion = clip.local_rotation.astype(np.float64).reshape(-1, 4)
    local = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    local = local.reshape(clip.frames, -1, 3, 3)
    offsets = kinematics.offsets().double().numpy()
    root = clip.root_position_m.astype(np.float64)
    return forward(character.PARENTS, offsets, local, root)


def _alignment(rig: Rig, parts: dict[str, int]) -> tuple[int, Array]:
    """Return the upward axis of a rig at rest, 1 or 2, and the rotation [3, 3] from the file's
    axes to those of a body that faces our +x."""
    ankles = 0.5 * (rig.position[parts["right_ankle"]] + rig.position[parts["left_ankle"]])
    tall = rig.position[parts["head"]] - ankles
    up = int(np.argmax(np.abs(tall)))
    left = rig.position[parts["left_hip"]] - rig.position[parts["right_hip"]]
    left[up] = 0.0
    z = np.eye(3)[up]
    y = left / np.linalg.norm(left)
    return up, np.stack((np.cross(y, z), y, z))


def _common(rig: Rig, parts: dict[str, int], part: str) -> int:
    """Return the joint above both sides of a part: the hips, or the chest."""
    chains = [_above(rig, parts[f"{side}_{part}"]) for side in SIDES]
    common = next((joint for joint in chains[0] if joint in chains[1]), None)
    if common is None:
        raise RigError(f"--rig {rig.name}: no joint is above both its {part}s: what turns them?")
    return common


def _above(rig: Rig, joint: int) -> list[int]:
    """Return the ancestors of a joint, the nearest first."""
    found = []
    while rig.parents[joint] >= 0:
        joint = rig.parents[joint]
        found.append(joint)
    return found


def _top(rig: Rig, joint: int) -> int:
    return (joint, *_above(rig, joint))[-1]


def _lowest(rig: Rig, pelvis: int, chest: int) -> int:
    """Return the lowest joint that has pelvis and chest below it, or is one of them."""
    above = (chest, *_above(rig, chest))
    found = next((joint for joint in (pelvis, *_above(rig, pelvis)) if joint in above), None)
    if found is None:
        raise RigError(f"--rig {rig.name}: no joint is above both its hips and its shoulders")
    return found


def _mapped(
    rig: Rig, parts: dict[str, int], body: Array, pelvis: tuple[int, ...], chest: int
) -> dict[int, tuple[int, Array]]:
    """Return for each joint that turns as one of our bodies: the body, and the rotation [3, 3] from
    the file's axes at rest to the body's axes."""
    index = character.BODIES.index
    found = {chest: (index("torso"), body), parts["head"]: (index("head"), body)}
    found |= {joint: (index("pelvis"), body) for joint in pelvis}
    for part, (ours, end) in _BONES.items():
        along = body @ (rig.position[parts[end]] - rig.position[parts[part]])
        length = np.linalg.norm(along)
        if not length > 0:
            raise RigError(f"--rig {rig.name}: {part} and {end} are the same point")
        found[parts[part]] = index(ours), _least(along / length, _DOWN) @ body
    for side in SIDES:
        ankle, toe = parts[f"{side}_ankle"], parts.get(f"{side}_toe")
        own = body
        if toe is not None:
            x, y, _ = body @ (rig.position[toe] - rig.position[ankle])
            if np.hypot(x, y) > _FOOT * _leg(rig, parts):
                own = Rotation.from_euler("z", -np.arctan2(y, x)).as_matrix() @ body
        found[ankle] = index(f"{side}_foot"), own
    return found


def _least(start: Array, end: Array) -> Array:
    """Return the smallest rotation [3, 3] that turns one unit vector into another."""
    axis, cosine = np.cross(start, end), float(start @ end)
    if cosine < -1.0 + 1e-9:
        # opposite: arms straight up; about the forward axis, as arms are raised
        return Rotation.from_rotvec([np.pi, 0.0, 0.0]).as_matrix()
    sine = np.linalg.norm(axis)
    if sine < 1e-12:
        return np.eye(3)
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix()


def _between(rig: Rig, stops: tuple[int, ...]) -> list[tuple[int, int, int, float]]:
    """Return the joints between the stops of the trunk: the stop below, the joint, the stop above,
    and how far between them the joint is, 0 to 1."""
    found = []
    for low, high in itertools.pairwise(stops):
        chain = _above(rig, high)
        if low not in chain:
            continue
        inner = chain[: chain.index(low)][::-1]
        found += [(low, j, high, (k + 1) / (len(inner) + 1)) for k, j in enumerate(inner)]
    return found


def _part_way(low: Array, high: Array, fraction: float) -> Array:
    """Return rotations [T, 3, 3] between two, on the shortest arc."""
    arc = Rotation.from_matrix(np.swapaxes(low, -1, -2) @ high).as_rotvec()
    return low @ Rotation.from_rotvec(fraction * arc).as_matrix()


def _follow(rig: Rig, turns: dict[int, tuple[int, Array]], trunk: set[int], delta: Array) -> None:
    """Set the joints that have no body of ours to the turn of the joint above them."""
    for joint, parent in enumerate(rig.parents):
        if joint not in turns and joint not in trunk and parent >= 0:
            delta[:, joint] = delta[:, parent]


def _bend_legs(
    rig: Rig, parts: dict[str, int], place: Array, rotation: Array, delta: Array
) -> None:
    """Turn thighs and shins in their plane so that the ankle is as far from the hip, and in the
    direction, as ours.

    place [T, 15, 3], rotation [T, 15, 3, 3]: of our bodies, scaled to the rig, in the file's axes.
    """
    for side in SIDES:
        hip, knee, ankle = (parts[f"{side}_{part}"] for part in ("hip", "knee", "ankle"))
        thigh, shin, foot = (
            character.BODIES.index(f"{side}_{body}") for body in ("thigh", "shin", "foot")
        )
        upper = np.linalg.norm(rig.position[knee] - rig.position[hip])
        lower = np.linalg.norm(rig.position[ankle] - rig.position[knee])
        line = place[:, foot] - place[:, thigh]
        length = np.linalg.norm(line, axis=1)
        reach = np.clip(length, abs(upper - lower) * (1 + 1e-9), (upper + lower) * (1 - 1e-12))
        cosine = (upper**2 + reach**2 - lower**2) / (2 * upper * reach)
        # knees bend about +y: the thigh is ahead of the line from hip to ankle
        axis = rotation[:, thigh, :, 1]
        ahead = -np.arccos(np.clip(cosine, -1.0, 1.0))[:, None] * axis
        along = line / np.maximum(length, 1e-9)[:, None]
        first = Rotation.from_rotvec(ahead).apply(along)
        second = (reach[:, None] * along - upper * first) / lower
        for joint, body, now in ((hip, thigh, first), (knee, shin, second)):
            was = -rotation[:, body, :, 2]
            sine = np.sum(axis * np.cross(was, now), axis=1)
            turn = np.arctan2(sine, np.sum(was * now, axis=1))[:, None] * axis
            delta[:, joint] = Rotation.from_rotvec(turn).as_matrix() @ delta[:, joint]


def _leg(rig: Rig, parts: dict[str, int]) -> float:
    """Return the mean length of the legs from hip to ankle along the bones."""
    lengths = []
    for side in SIDES:
        hip, knee, ankle = (rig.position[parts[f"{side}_{p}"]] for p in ("hip", "knee", "ankle"))
        lengths.append(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))
    return float(np.mean(lengths))


def _travel(
    clip: Clip, rig: Rig, parts: dict[str, int], up: int, axes: Array, hips: int,
    delta: Array, scale: float,
) -> Array:  # fmt: skip
    """Return the places [T, 3] of the hips' joint: the middle of both hip joints moves as ours,
    scaled, and raised by how much higher the rig's ankles are above their soles."""
    middle = 0.5 * (rig.position[parts["right_hip"]] + rig.position[parts["left_hip"]])
    ours = scale * clip.root_position_m.astype(np.float64) @ axes.T
    ours[:, up_of(axes)] += scale * (_ankle(rig, parts, up, scale) - ANKLE_M)
    return ours - delta @ (middle - rig.position[hips])


def up_of(axes: Array) -> int:
    """Return the upward axis of the world that `axes` [3, 3] lead to from ours."""
    return int(np.argmax(axes[:, 2]))


def _ankle(rig: Rig, parts: dict[str, int], up: int, scale: float) -> float:
    """Return the height of the ankles above the sole at our size, m: at rest, for a rig that stands
    on 0, else from the toes as an import does."""
    ankles = [rig.position[parts[f"{side}_ankle"]][up] for side in SIDES]
    height = float(np.mean(ankles)) / scale
    if 0 < height < _STANDS * LEG_M:
        return height
    toes = [rig.position[parts[f"{side}_toe"]][up] for side in SIDES if f"{side}_toe" in parts]
    drop = height - float(np.mean(toes)) / scale + _TOE_M if len(toes) == 2 else 0.0
    return float(np.clip(drop, *_ANKLES_M))
