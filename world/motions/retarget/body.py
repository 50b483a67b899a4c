"""Targets of the character's bodies from a recording: scaled, upright, at 30 Hz.

Joint positions and global rotations are used, never local angles, since rest poses differ between
files. The axes of the bodies are estimated from the frames in which the person is straight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from world.character import model as character
from world.character.soles import ANKLE_M
from world.errors import ClipError
from world.motions.formats.landmarks import SIDES
from world.motions.formats.recording import RecordedBox, Recording

Array = np.ndarray

#: Length of our leg from hip to ankle, m.
LEG_M = 0.421546 + 0.40987
#: Least and greatest length of an adult's legs from hip to ankle, m, from which units are inferred.
_LEGS_M = (0.55, 1.20)
#: Length units in use: m, cm, mm, inch, and CMU's 1/0.45 inch.
_UNITS_M = (1.0, 0.01, 0.001, 0.0254, 0.0254 / 0.45)
#: A foot that is slower than this, m/s, and at most this above its lowest height, m, stands.
_STANDS_M_S, _STANDS_M = 0.2, 0.05
#: Pitch of the line from ankle to toes on a flat foot, for clips that never stand, rad.
_TOE_PITCH_RAD = np.deg2rad(20.0)


#: (x, y, z) -> (x, -z, y)
_Y_TO_Z = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
_OWN = {
    "head": "head",
    **{
        f"{side}_{part}": f"{side}_{body}"
        for side in SIDES
        for part, body in (
            ("hip", "thigh"), ("knee", "shin"), ("ankle", "foot"),
            ("shoulder", "upper_arm"), ("elbow", "lower_arm"), ("wrist", "hand"),
        )
    },
}  # fmt: skip


@dataclass(frozen=True)
class Scaled:
    """A recording in metres, z up, at 30 Hz, at the character's size and on its floor."""

    fps: int
    position: Array
    """[T, J, 3] m."""
    rotation: Array
    """[T, J, 3, 3]."""
    joint: Mapping[str, int]
    """Index of the joint of each part of the body."""
    parents: tuple[int, ...]
    scale: float
    """Length of our leg over that of the recorded one."""
    ankle_m: float
    """Height of the recorded ankle above its sole, scaled, m."""
    box: RecordedBox | None = None
    """The tracked box, scaled as the person."""

    def at(self, role: str) -> Array:
        """Positions [T, 3] of a part of the body."""
        return self.position[:, self.joint[role]]

    def turn(self, index: int) -> Array:
        """Rotations [T, 3, 3] of a joint."""
        return self.rotation[:, index]

    def lowered(self, by_m: Array) -> "Scaled":
        """The recording lowered by by_m [T] m in each frame."""
        box = self.box
        if box is not None:
            box = replace(box, position=box.position - by_m[:, None] * np.array([0, 0, 1.0]))
        return replace(
            self, position=self.position - by_m[:, None, None] * np.array([0, 0, 1.0]), box=box
        )


@dataclass(frozen=True)
class Targets:
    """Targets of our 15 bodies: T frames."""

    root: Array
    """[T, 3] m: the pelvis."""
    rotation: Array
    """[T, 15, 3, 3]: of each body in the world."""
    ankle: Array
    """[T, 2, 3] m: right and left, at our ankles' height above the floor."""
    hand: Array
    """[T, 2, 3] m: right and left."""


def scaled(recording: Recording, joint: Mapping[str, int], fps: int) -> Scaled:
    """The recording at our size, upright, at `fps`. Raises ClipError for implausible units."""
    position, rotation = _z_up(recording, joint)
    leg = _leg(position, joint)
    low, high = _LEGS_M
    unit = recording.unit_m
    if unit is None and low <= leg * (recording.likely_unit_m or 0.0) <= high:
        unit = recording.likely_unit_m
    if unit is None:
        unit = infer_unit_m(recording.name, leg)
    if not low <= leg * unit <= high:
        raise ClipError(
            f"{recording.name}: absurd units: legs of {leg * unit:.3g} m from hip to ankle,"
            f" expected {low} to {high}; say the length unit with --unit, or unit_m in a --map file"
        )
    scale = LEG_M / leg
    position, rotation = resampled(position * scale, rotation, recording.fps, fps)
    floor, ankle = _floor(position, joint, fps)
    down = np.array([0, 0, floor])
    box = None if recording.box is None else _scaled_box(recording, scale, scale / unit, fps)
    if box is not None:
        box = replace(box, position=box.position - down)
    return Scaled(
        fps, position - down, rotation, joint, recording.parents, scale / unit, ankle, box
    )


def _scaled_box(recording: Recording, scale: float, size: float, fps: int) -> RecordedBox:
    """The tracked box at the character's scale, z up, at `fps`; `size`: the scale of metres."""
    box = recording.box
    assert box is not None
    position, rotation = box.position[:, None], box.rotation[:, None]
    if recording.up == "y":
        position, rotation = position @ _Y_TO_Z.T, _Y_TO_Z @ rotation
    position, rotation = resampled(position * scale, rotation, recording.fps, fps)
    x, y, z = (size * edge for edge in box.size_m)
    return RecordedBox(position[:, 0], rotation[:, 0], (x, y, z))


def own(recording: Recording, fps: int) -> tuple[Scaled, Targets]:
    """A recording on the character's own body, at `fps`, otherwise unchanged."""
    position, rotation = resampled(recording.position, recording.rotation, recording.fps, fps)
    joint = {role: character.BODIES.index(body) for role, body in _OWN.items()}
    scaled = Scaled(fps, position, rotation, joint, recording.parents, 1.0, ANKLE_M)
    return scaled, own_targets(scaled)


def own_targets(scaled: Scaled) -> Targets:
    """Targets of a recording on the character's own body."""
    position = scaled.position
    return Targets(
        position[:, 0], scaled.rotation[:, :15], position[:, [11, 14]], position[:, [5, 8]]
    )


def _z_up(recording: Recording, joint: Mapping[str, int]) -> tuple[Array, Array]:
    if (recording.up or upward(recording, joint)) == "z":
        return recording.position, recording.rotation
    return recording.position @ _Y_TO_Z.T, _Y_TO_Z @ recording.rotation


def upward(recording: Recording, joint: Mapping[str, int]) -> str:
    """The upward axis, y or z: the likely one, unless the person mostly stands along the other one
    with the feet near its 0, never stands along the likely one, and does not lie still at its 0.
    """
    likely = "yz".index(recording.likely_up) + 1
    other = 3 - likely
    position = recording.position
    feet = 0.5 * (position[:, joint["right_ankle"]] + position[:, joint["left_ankle"]])
    body = position[:, joint["head"]] - feet
    length = np.maximum(np.linalg.norm(body, axis=-1), 1e-9)
    tall = length.max()
    along = body / length[:, None]
    mostly = np.median(along[:, other]) > 0.8
    never = (along[:, likely] < 0.7).all()
    grounded = abs(np.percentile(feet[:, other], 2)) < 0.2 * tall
    stays = np.ptp(feet, axis=0).max() < 0.4 * tall
    lies = stays and -0.06 * tall < position[..., likely].min() < 0.2 * tall
    return "yz"[other - 1] if mostly and never and grounded and not lies else recording.likely_up


def _leg(position: Array, joint: Mapping[str, int]) -> float:
    """Length of the legs from hip to ankle along the bones, in the file's unit."""
    lengths = []
    for side in SIDES:
        hip, knee, ankle = (position[:, joint[f"{side}_{p}"]] for p in ("hip", "knee", "ankle"))
        lengths.append(np.linalg.norm(hip - knee, axis=-1) + np.linalg.norm(knee - ankle, axis=-1))
    leg = float(np.median(lengths))
    if not leg > 0:
        raise ClipError("legs of no length: hip, knee and ankle are the same point")
    return leg


def infer_unit_m(name: str, leg: float) -> float:
    """The length unit, m, in which legs of `leg` units are an adult's. Raises ClipError without
    one."""
    low, high = _LEGS_M
    for unit in _UNITS_M:
        if low <= leg * unit <= high:
            return unit
    raise ClipError(
        f"{name}: absurd units: legs of {leg:.4g} units from hip to ankle are a person's neither in"
        " m, cm, mm, inches nor CMU's unit; say the length unit with --unit, or unit_m in a --map"
        " file"
    )


def resampled(position: Array, rotation: Array, fps: float, to_fps: int) -> tuple[Array, Array]:
    """Positions [T, J, 3] and rotations [T, J, 3, 3] at another rate, interpolated on lines and
    shortest arcs."""
    frames = position.shape[0]
    if abs(fps - to_fps) < 0.01 * to_fps:
        return position, rotation
    count = max(2, int(np.floor((frames - 1) * to_fps / fps + 1e-6)) + 1)
    at = np.minimum(np.arange(count) * fps / to_fps, frames - 1)
    low = np.minimum(at.astype(int), frames - 2)
    fraction = (at - low)[:, None, None]
    moved = position[low] * (1 - fraction) + position[low + 1] * fraction
    turned = np.empty((count, *rotation.shape[1:]))
    for joint in range(rotation.shape[1]):
        arc = Slerp(np.arange(frames), Rotation.from_matrix(rotation[:, joint]))
        turned[:, joint] = arc(at).as_matrix()
    return moved, turned


def speeds(position: Array, fps: int) -> Array:
    """Speeds [T, ...] of points [T, ..., 3], central differences."""
    return np.linalg.norm(np.gradient(position, axis=0), axis=-1) * fps


def _floor(position: Array, joint: Mapping[str, int], fps: int) -> tuple[float, float]:
    """Height of the floor, and of the ankle above it, m, from standing feet."""
    ankles = position[:, [joint["right_ankle"], joint["left_ankle"]]]
    toes = position[:, [joint.get("right_toe", joint["right_ankle"]),
                        joint.get("left_toe", joint["left_ankle"])]]  # fmt: skip
    low = np.percentile(ankles[..., 2], 5)
    still = (speeds(ankles, fps) < _STANDS_M_S) & (ankles[..., 2] < low + _STANDS_M)
    upright = position[:, joint["head"], 2] - ankles[..., 2].min(axis=1) > 0.9 * LEG_M
    still &= upright[:, None]
    if still.sum() < 0.1 * fps:
        # no standing foot: lying on the floor, or in the air
        return float(np.percentile(position[..., 2].min(axis=1), 2) - 0.03), 0.08
    # the lower of the still feet are flat, the others lift their heel
    ankle = float(np.percentile(ankles[..., 2][still], 25))
    toe = float(np.percentile(toes[..., 2][still], 25))
    # a toe joint is about 2 cm above the sole, and no ankle is lower than 4 cm
    floor = min(toe - 0.02, ankle - 0.06)
    floor = max(floor, ankle - 0.12)
    return floor, ankle - floor


def targets(source: Scaled) -> Targets:
    """Targets of the character's bodies from a scaled recording."""
    frames = source.position.shape[0]
    rotation = np.empty((frames, 15, 3, 3))
    straight = _straightness(source)
    hips = source.at("left_hip") - source.at("right_hip")
    shoulders = source.at("left_shoulder") - source.at("right_shoulder")
    middle = 0.5 * (source.at("left_hip") + source.at("right_hip"))
    trunk = 0.5 * (source.at("left_shoulder") + source.at("right_shoulder")) - middle
    pelvis = _common_parent(source, "hip")
    chest = _common_parent(source, "shoulder")
    rotation[:, 0] = _rigid(source.turn(pelvis), hips, trunk, straight)
    rotation[:, 1] = _rigid(source.turn(chest), shoulders, trunk, straight)
    rotation[:, 2] = _aligned(source.turn(source.joint["head"]), rotation[:, 1], straight)
    for index, side in enumerate(SIDES):
        shoulder, thigh = 3 + 3 * index, 9 + 3 * index
        rotation[:, shoulder], rotation[:, shoulder + 1] = _limb(
            source, (f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist"), rotation[:, 1], 1,
            straight,
        )  # fmt: skip
        rotation[:, shoulder + 2] = rotation[:, shoulder + 1]
        rotation[:, thigh], rotation[:, thigh + 1] = _limb(
            source, (f"{side}_hip", f"{side}_knee", f"{side}_ankle"), rotation[:, 0], -1, straight
        )
        rotation[:, thigh + 2] = _foot(source, side, rotation[:, thigh + 1], straight)
    drop = np.array([0, 0, source.ankle_m - ANKLE_M])
    ankle, hand = (
        np.stack([source.at(f"{side}_{part}") for side in SIDES], axis=1) - drop
        for part in ("ankle", "wrist")
    )
    return Targets(middle - drop, rotation, ankle, hand)


def _straightness(source: Scaled) -> Array:
    """Weights [T], of mean 1, large where trunk, thighs and shins are in line."""
    middle = 0.5 * (source.at("left_hip") + source.at("right_hip"))
    trunk = _unit(0.5 * (source.at("left_shoulder") + source.at("right_shoulder")) - middle)
    score = np.ones(len(trunk))
    for side in SIDES:
        thigh = _unit(source.at(f"{side}_hip") - source.at(f"{side}_knee"))
        shin = _unit(source.at(f"{side}_knee") - source.at(f"{side}_ankle"))
        for a, b in ((trunk, thigh), (thigh, shin)):
            score *= np.clip((np.sum(a * b, axis=-1) - 0.7) / 0.3, 0, 1)
    if score.max() < 0.1:
        # never straight: the straightest frames are used
        bent = np.sum(trunk * _unit(source.at("left_hip") - source.at("left_knee")), axis=-1)
        score = (bent >= np.percentile(bent, 80)).astype(float)
    return score / score.mean()


def _common_parent(source: Scaled, part: str) -> int:
    """The common parent of both sides' joints: the pelvis of hips, the chest of shoulders."""

    def above(index: int) -> list[int]:
        chain = []
        while index >= 0:
            chain.append(index)
            index = source.parents[index]
        return chain

    right = above(source.joint[f"right_{part}"])[1:]
    return next(index for index in above(source.joint[f"left_{part}"])[1:] if index in right)


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def _frame(left: Array, up: Array) -> Array:
    """Rotations [..., 3, 3] whose z is `up` and whose y is nearest to `left`."""
    z = _unit(up)
    x = _unit(np.cross(left, z))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _local_mean(turn: Array, vector: Array, weight: Array) -> Array:
    """Weighted mean [3] of world vectors [T, 3] in a joint's own axes."""
    return np.einsum("t,tji,tj->i", weight, turn, _unit(vector))


def _rigid(turn: Array, left: Array, up: Array, weight: Array) -> Array:
    """A joint's rotations [T, 3, 3] with axes whose weighted mean has y along `left` and z along
    `up`."""
    own = _frame(_local_mean(turn, left, np.ones(len(left))), _local_mean(turn, up, weight))
    return turn @ own


def _aligned(turn: Array, other: Array, weight: Array) -> Array:
    """A joint's rotations [T, 3, 3] with the axes of `other`, on weighted average."""
    mean = np.einsum("t,tji,tjk->ik", weight, turn, other)
    return turn @ Rotation.from_matrix(_nearest(mean)).as_matrix()


def _nearest(matrix: Array) -> Array:
    """The rotation nearest to a 3 x 3 matrix."""
    u, _, v = np.linalg.svd(matrix)
    return u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v


def _limb(
    source: Scaled, roles: tuple[str, str, str], parent: Array, bend: int, straight: Array
) -> tuple[Array, Array]:
    """Rotations [T, 3, 3] of both bones of a limb with a one-axis joint, from its three joints.

    Args:
        roles: the limb's start, hinge and end.
        parent: [T, 3, 3], the parent body, for the direction of a hinge that never bends.
        bend: +1 for an elbow (the end moves forward), −1 for a knee.
    """
    start, hinge, end = (source.at(role) for role in roles)
    turn = source.turn(source.joint[roles[0]])
    first, second = _unit(hinge - start), _unit(end - hinge)
    normal = bend * np.cross(second, first)
    sine = np.linalg.norm(normal, axis=-1)
    weight = np.where(sine > 0.25, 1.0, 0.0)
    own = np.einsum("t,tji,tj->i", weight, turn, normal)
    if weight.sum() < 3 or np.linalg.norm(own) < 0.5 * np.sum(weight * sine):
        own = np.einsum("t,tji,tj->i", straight, turn, parent[:, :, 1])
    axis = _unit(turn @ _unit(own))
    # the plane of the limb, where it is bent enough to define one
    fraction = np.clip((sine - 0.25) / 0.45, 0, 1)[:, None]
    fraction = (
        fraction * fraction * (3 - 2 * fraction) * (np.sum(axis * normal, axis=-1) > 0)[:, None]
    )
    left = axis * (1 - fraction) + _unit(normal) * fraction
    upper = _frame(left, -first)
    flexion = np.arccos(np.clip(np.sum(first * second, axis=-1), -1, 1))
    hinged = Rotation.from_rotvec(np.stack([0 * flexion, -bend * flexion, 0 * flexion], -1))
    return upper, upper @ hinged.as_matrix()


def _foot(source: Scaled, side: str, shin: Array, straight: Array) -> Array:
    """The foot's rotations [T, 3, 3]: level where it stands, along the line from ankle to toes."""
    ankle = source.at(f"{side}_ankle")
    turn = source.turn(source.joint[f"{side}_ankle"])
    toe = source.joint.get(f"{side}_toe")
    point = _unit(source.position[:, toe] - ankle) if toe is not None else shin[:, :, 0]
    stands = (speeds(ankle, source.fps) < _STANDS_M_S) & (
        np.abs(ankle[:, 2] - source.ankle_m) < 0.03
    )
    if stands.sum() >= 3:
        up = _local_mean(turn, np.tile([0.0, 0, 1], (len(ankle), 1)), stands.astype(float))
    else:
        # bent down from level by the usual slope of the instep
        ahead = _local_mean(turn, point, np.ones(len(ankle)))
        up = _local_mean(turn, -_unit(source.at(f"{side}_ankle") - source.at(f"{side}_knee")),
                         straight)  # fmt: skip
        left = _unit(np.cross(up, ahead))
        lifted = Rotation.from_rotvec(-_TOE_PITCH_RAD * left).apply(_unit(ahead))
        up = np.cross(lifted, left)
    ahead = _local_mean(turn, point, np.ones(len(ankle)))
    own = _frame(np.cross(_unit(up), _unit(ahead)), up)
    return turn @ own


def generalised(target: Targets) -> tuple[Array, Array]:
    """Local rotations [T, 15, 4] (w, x, y, z) of world rotations, and the root [T, 3]."""
    local = target.rotation.copy()
    for body, parent in enumerate(character.PARENTS):
        if parent >= 0:
            local[:, body] = (
                np.swapaxes(target.rotation[:, parent], -1, -2) @ target.rotation[:, body]
            )
    quaternion = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    return quaternion.reshape(-1, 15, 4), target.root
