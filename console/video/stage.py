"""The displayed scene: floor grid, sky, lights, materials, and a rounded character.

The display model has the bodies and coordinates of the simulated one, so that a state is drawn by
setting it. It is never stepped.
"""

from collections.abc import Iterator
from typing import Literal

import mujoco
import numpy as np

from world.character import model as character
from world.scene.model import FURNITURE_BODY, PROJECTILE_BODY

Shapes = Literal["body", "shapes"]
Rgba = tuple[float, float, float, float]
Point = tuple[float, float, float]

#: Name of the floor's geom.
FLOOR = "floor"
#: Groups of geoms that are drawn: character and floor; furniture, boxes and balls.
SHOWN, OBJECTS = 0, 1
#: Group of the character's collision shapes behind a rounded body.
_COLLISION = 3
#: Colours of the sky above and at the horizon.
SKY_TOP, SKY_BOTTOM = (0.62, 0.74, 0.86), (0.86, 0.90, 0.93)
_FLOOR, _LINES = (0.80, 0.82, 0.83), (0.70, 0.725, 0.745)
#: Direction of the light, and its distance from what is looked at, m: so far that all of the floor
#: that can be seen lies in front of it.
_SUN, _SUN_M = (0.35, 0.42, -0.84), 16.0
#: Unit of the distances of fog, planes and shadows, m.
EXTENT_M = 4.0


_SKIN: Rgba = (0.82, 0.66, 0.56, 1.0)
_SHIRT: Rgba = (0.27, 0.45, 0.62, 1.0)
_TROUSERS: Rgba = (0.25, 0.27, 0.33, 1.0)
_SHOES: Rgba = (0.17, 0.17, 0.19, 1.0)
#: Colours of the rounded character by name.
CLOTHES = {"skin": _SKIN, "shirt": _SHIRT, "trousers": _TROUSERS, "shoes": _SHOES}
_BALL: Rgba = (0.82, 0.30, 0.22, 1.0)
BOX: Rgba = (0.78, 0.62, 0.42, 1.0)
#: A character that is followed.
GHOST: Rgba = (0.95, 0.75, 0.35, 0.35)
_OTHER: Rgba = (0.66, 0.60, 0.54, 1.0)
#: Colour of furniture by a word of the piece's name.
FURNITURE: dict[str, Rgba] = {
    "chair": (0.70, 0.48, 0.30, 1.0),
    "armchair": (0.43, 0.53, 0.46, 1.0),
    "stool": (0.76, 0.58, 0.36, 1.0),
    "bench": (0.60, 0.44, 0.30, 1.0),
    "sofa": (0.50, 0.42, 0.50, 1.0),
    "bed": (0.80, 0.77, 0.71, 1.0),
    "table": (0.64, 0.47, 0.33, 1.0),
}
#: The rounded character: for each body ellipsoids (centre, half axes) and capsules (ends, radius),
#: in the body's frame, m, with their colour. Left limbs are the mirror images of the right ones.
_ROUND: dict[str, list[tuple[str, tuple[float, ...], Rgba]]] = {
    "pelvis": [
        ("ellipsoid", (-0.01, 0.0, 0.05, 0.115, 0.15, 0.11), _TROUSERS),
        ("capsule", (-0.01, -0.07, 0.0, -0.01, 0.07, 0.0, 0.085), _TROUSERS),
        ("ellipsoid", (0.0, 0.0, 0.17, 0.10, 0.132, 0.13), _SHIRT),
    ],
    "torso": [
        ("ellipsoid", (0.0, 0.0, 0.02, 0.102, 0.138, 0.14), _SHIRT),
        ("ellipsoid", (0.005, 0.0, 0.14, 0.118, 0.158, 0.155), _SHIRT),
        ("capsule", (-0.015, -0.125, 0.232, -0.015, 0.125, 0.232, 0.062), _SHIRT),
        ("capsule", (-0.01, 0.0, 0.22, 0.0, 0.0, 0.31, 0.048), _SKIN),
    ],
    "head": [
        ("capsule", (-0.005, 0.0, -0.02, 0.0, 0.0, 0.10, 0.047), _SKIN),
        ("ellipsoid", (0.008, 0.0, 0.172, 0.092, 0.076, 0.115), _SKIN),
        ("ellipsoid", (0.095, 0.0, 0.16, 0.020, 0.014, 0.024), _SKIN),
        ("ellipsoid", (-0.014, 0.0, 0.20, 0.092, 0.082, 0.098), _SHOES),
    ],
    "right_upper_arm": [
        ("ellipsoid", (0.0, 0.005, -0.01, 0.064, 0.062, 0.075), _SHIRT),
        ("capsule", (0.0, 0.0, -0.02, 0.0, 0.0, -0.15, 0.052), _SHIRT),
        ("capsule", (0.0, 0.0, -0.12, 0.0, 0.0, -0.268, 0.043), _SKIN),
    ],
    "right_lower_arm": [
        ("ellipsoid", (0.0, 0.0, -0.07, 0.045, 0.044, 0.10), _SKIN),
        ("capsule", (0.0, 0.0, 0.0, 0.0, 0.0, -0.235, 0.033), _SKIN),
    ],
    "right_hand": [
        ("ellipsoid", (0.005, 0.0, -0.02, 0.040, 0.026, 0.062), _SKIN),
        ("capsule", (0.012, 0.0, -0.05, 0.018, 0.0, -0.085, 0.018), _SKIN),
    ],
    "right_thigh": [
        ("ellipsoid", (0.0, 0.0, -0.12, 0.085, 0.08, 0.19), _TROUSERS),
        ("capsule", (0.0, 0.0, -0.03, 0.0, 0.0, -0.415, 0.062), _TROUSERS),
    ],
    "right_shin": [
        ("ellipsoid", (-0.014, 0.0, -0.13, 0.062, 0.056, 0.15), _TROUSERS),
        ("capsule", (0.0, 0.0, -0.01, 0.0, 0.0, -0.37, 0.047), _TROUSERS),
    ],
    "right_foot": [
        ("ellipsoid", (0.0, 0.0, -0.005, 0.048, 0.043, 0.05), _SHOES),
        ("capsule", (-0.012, 0.0, -0.018, 0.098, 0.0, -0.024, 0.032), _SHOES),
        ("ellipsoid", (0.052, 0.0, -0.03, 0.088, 0.045, 0.024), _SHOES),
    ],
}


def furniture_colour(piece: str) -> Rgba:
    """Return the colour of furniture by its name, whose words tell its class."""
    return next((FURNITURE[word] for word in piece.split("-") if word in FURNITURE), _OTHER)


def stage(simulated: mujoco.MjModel, piece: str = "", shapes: Shapes = "body") -> mujoco.MjModel:
    """Return the display model of a simulated scene.

    simulated: its model; furniture, boxes and projectiles are copied from it.
    piece: name of the furniture, whose class gives its colour.
    shapes: body, a rounded character; shapes, its collision shapes.
    """
    spec = _character(shapes)
    _surroundings(spec)
    own = {body.name for body in spec.bodies}
    for number in range(1, simulated.nbody):
        if simulated.body(number).name not in own:
            _copy_body(spec, simulated, number, colour_of(simulated, number, piece))
    model = spec.compile()
    model.vis.headlight.ambient[:] = 0.42
    model.vis.headlight.diffuse[:] = 0.24
    model.vis.headlight.specular[:] = 0.0
    # the region that the shadow map covers, and the planes of the camera
    model.stat.extent, model.stat.center[:] = EXTENT_M, 0.0
    model.vis.map.znear, model.vis.map.zfar = 0.02, 12.0
    model.vis.map.fogstart, model.vis.map.fogend = 1.3, 2.7
    model.vis.rgba.fog[:] = model.vis.rgba.haze[:] = (*SKY_BOTTOM, 1.0)
    return model


def character_alone(shapes: Shapes = "body") -> mujoco.MjModel:
    """Return the model of the character without a scene, for a second one in it."""
    return _character(shapes).compile()


def _character(shapes: Shapes) -> mujoco.MjSpec:
    spec = character.spec()
    for geom in spec.geoms:
        geom.group = _COLLISION if shapes == "body" else SHOWN
    if shapes == "body":
        _round(spec)
    return spec


def light_at(model: mujoco.MjModel, centre: np.ndarray) -> None:
    """Move the light, whose shadows reach a few metres, to a point [3] that is looked at, m."""
    model.light("sun").pos[:] = centre - _SUN_M * np.array(_SUN)


def options() -> mujoco.MjvOption:
    """Return the options that show what is drawn alone."""
    shown = mujoco.MjvOption()
    shown.geomgroup[:] = 0
    shown.geomgroup[[SHOWN, OBJECTS]] = 1
    return shown


def _surroundings(spec: mujoco.MjSpec) -> None:
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=SKY_TOP,
        rgb2=SKY_BOTTOM,
        width=128,
        height=768,
    )
    spec.add_texture(
        name="grid",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=_FLOOR,
        rgb2=_FLOOR,
        markrgb=_LINES,
        width=256,
        height=256,
    )
    floor = spec.add_material(name="floor", texrepeat=[2.0, 2.0], texuniform=True, specular=0.0)
    floor.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "grid"
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0, 0, 0.05],
        material="floor",
        group=SHOWN,
    )
    spec.worldbody.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        dir=_SUN,
        castshadow=True,
        diffuse=[0.62, 0.60, 0.57],
        specular=[0.12, 0.12, 0.12],
        ambient=[0.0, 0.0, 0.0],
    )


def _round(spec: mujoco.MjSpec) -> None:
    """Add the rounded shapes to the bodies of the character."""
    for body in spec.bodies:
        for kind, numbers, colour in _shapes_of(body.name):
            shape: dict[str, object]
            if kind == "ellipsoid":
                shape = {
                    "type": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
                    "pos": numbers[:3],
                    "size": numbers[3:],
                }
            else:
                shape = {
                    "type": mujoco.mjtGeom.mjGEOM_CAPSULE,
                    "fromto": numbers[:6],
                    "size": [numbers[6], 0, 0],
                }
            body.add_geom(rgba=colour, group=SHOWN, contype=0, conaffinity=0, mass=0.0, **shape)


def _shapes_of(body: str) -> Iterator[tuple[str, tuple[float, ...], Rgba]]:
    for kind, numbers, colour in _ROUND.get(body.replace("left_", "right_"), []):
        if not body.startswith("left_"):
            yield kind, numbers, colour
            continue
        mirrored = list(numbers)
        for index in (1,) if kind == "ellipsoid" else (1, 4):
            mirrored[index] = -mirrored[index]
        yield kind, tuple(mirrored), colour


def colour_of(model: mujoco.MjModel, number: int, piece: str) -> Rgba:
    """Return the colour of a body that is no part of the character; piece: the furniture's name."""
    name = model.body(number).name
    if name.startswith(PROJECTILE_BODY):
        return _BALL
    if name == FURNITURE_BODY:
        return furniture_colour(piece)
    return BOX if int(model.body_mocapid[number]) < 0 else _OTHER


def _copy_body(spec: mujoco.MjSpec, source: mujoco.MjModel, number: int, colour: Rgba) -> None:
    """Add a body of the simulated scene that is no part of the character, with what is visible."""
    found = source.body(number)
    mocap = int(source.body_mocapid[number]) >= 0
    body = spec.worldbody.add_body(name=found.name, pos=found.pos, quat=found.quat, mocap=mocap)
    if int(source.body_jntnum[number]):
        body.add_freejoint()
    body.mass, body.inertia, body.explicitinertial = 1.0, [1.0, 1.0, 1.0], True
    first = int(source.body_geomadr[number])
    for geom in range(first, first + int(source.body_geomnum[number])):
        if source.geom_rgba[geom][3] == 0.0:
            continue
        _copy_geom(spec, body, source, geom, colour)


def _copy_geom(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, source: mujoco.MjModel, geom: int, colour: Rgba
) -> None:
    kind = mujoco.mjtGeom(int(source.geom_type[geom]))
    shape = body.add_geom(
        type=kind,
        pos=source.geom_pos[geom],
        quat=source.geom_quat[geom],
        rgba=colour,
        group=OBJECTS,
        contype=0,
        conaffinity=0,
    )
    if kind != mujoco.mjtGeom.mjGEOM_MESH:
        shape.size = source.geom_size[geom]
        return
    mesh = int(source.geom_dataid[geom])
    start, count = int(source.mesh_vertadr[mesh]), int(source.mesh_vertnum[mesh])
    first, faces = int(source.mesh_faceadr[mesh]), int(source.mesh_facenum[mesh])
    name = f"{body.name}-mesh{geom}"
    spec.add_mesh(
        name=name,
        uservert=source.mesh_vert[start : start + count].flatten().tolist(),
        userface=source.mesh_face[first : first + faces].flatten().tolist(),
    )
    shape.meshname = name
