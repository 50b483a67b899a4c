"""Files of a motion for animation programs and engines, by the ending of their names."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco

from console import existing
from console.animation import bvh, gltf_scene, objects, rig, rig_files, smpl_file
from console.animation.gltf_scene import About, Figure
from console.animation.objects import Shape
from console.animation.retarget import standing
from console.animation.skeleton import of_clip
from console.commands.animation import AnimationFlags
from console.recording.clip import reference_of
from console.recording.format import Take
from world.character import model as character
from world.errors import ConfigError
from world.motions.clip import Clip
from world.partial_files import replacing


@dataclass(frozen=True)
class Animation:
    """A motion with its scene."""

    clip: Clip
    take: Take | None = None
    """States of the scene; None: the clip alone, with its box."""
    model: mujoco.MjModel | None = None
    """The simulator's model of the scene of `take`."""
    mesh: Shape | None = None
    """The furniture's own surface instead of its collision shapes."""


Writer = Callable[[Animation, AnimationFlags, str], bytes]


def _bvh(motion: Animation, flags: AnimationFlags, suffix: str) -> bytes:
    if flags.rig is not None:
        return rig_files.content(motion.clip, suffix, flags.rig, flags.joint_map)
    return bvh.text(motion.clip, flags.rest or "hanging", flags.root_motion).encode()


def _gltf(motion: Animation, flags: AnimationFlags, suffix: str) -> bytes:
    if flags.rig is not None:
        return rig_files.content(motion.clip, suffix, flags.rig, flags.joint_map)
    clip, take = motion.clip, motion.take
    figures = [Figure(of_clip(clip, "t-pose", flags.root_motion))]
    things: list[objects.Object] = []
    if take is not None and motion.model is not None:
        things = objects.of_take(take, motion.model, motion.mesh)
        reference = reference_of(take, clip)
        if reference is not None:
            figures.append(Figure(of_clip(reference, "t-pose"), gltf_scene.REFERENCE, 0.4))
    elif clip.box is not None:
        things = [objects.of_box(clip.box)]
    about = About(clip.name, clip.source, clip.licence)
    return gltf_scene.content(figures, things, clip.fps, about, suffix)


def _smpl(motion: Animation, flags: AnimationFlags, suffix: str) -> bytes:
    return smpl_file.content(motion.clip)


#: Writers by the ending of the file's name. A new format is one function and one line here.
WRITERS: dict[str, Writer] = {".glb": _gltf, ".gltf": _gltf, ".bvh": _bvh, smpl_file.SUFFIX: _smpl}
#: Formats that a rig may have, and those that may have a root joint.
_OF_RIGS = _WITH_ROOT = (".bvh", ".glb", ".gltf")
FBX = ".fbx"


def suffix_of(path: Path, suffixes: Sequence[str]) -> str:
    """Return the longest of the endings with which a file's name ends; empty without one."""
    name = path.name.lower()
    return max((s for s in suffixes if name.endswith(s) and name != s), key=len, default="")


def refuse_fbx(paths: Sequence[Path], flag: str) -> None:
    """Raise ConfigError for a file of FBX, with what to do instead."""
    for path in paths:
        if path.suffix.lower() == FBX:
            glb = path.with_suffix(".glb")
            raise ConfigError(
                f"{flag} {path}: FBX is not written (no open library that is kept up does);"
                f" write {glb} and convert it with Blender: blender --background --factory-startup"
                f' --python-expr "{blender_script(glb, path)}"'
            )


def blender_script(glb: Path, fbx: Path) -> str:
    """Return a line of Python by which Blender makes an FBX of a .glb: at 30 frames a second, with
    every frame, and the animation of all objects at once."""
    return (
        "import bpy; bpy.ops.wm.read_homefile(use_empty=True); s = bpy.context.scene;"
        f" s.render.fps = {character.CONTROL_HZ};"
        f" bpy.ops.import_scene.gltf(filepath='{glb}', disable_bone_shape=True);"
        " s.frame_start = 0; s.frame_end = round(max(a.frame_range[1] for a in bpy.data.actions));"
        f" bpy.ops.export_scene.fbx(filepath='{fbx}', add_leaf_bones=False,"
        " bake_anim_use_all_actions=False, bake_anim_use_nla_strips=False,"
        " bake_anim_simplify_factor=0)"
    )


def check(flags: AnimationFlags, paths: Sequence[Path]) -> None:
    """Raise ConfigError for flags that do not belong to any of the files, and for a rig that the
    motion cannot be put on."""
    kinds = {suffix_of(path, tuple(WRITERS)) for path in paths}
    if flags.rest is not None and ".bvh" not in kinds:
        raise ConfigError(f"--rest {flags.rest}: it is the choice of a .bvh, and none is written")
    if flags.root_motion and not kinds & set(_WITH_ROOT):
        raise ConfigError(f"--root-motion: for {', '.join(_WITH_ROOT)}, and none is written")
    if flags.joint_map is not None and flags.rig is None:
        raise ConfigError(f"--joint-map {flags.joint_map}: it needs --rig")
    if flags.rig is None:
        return
    for given, flag in ((flags.rest is not None, "--rest"), (flags.root_motion, "--root-motion")):
        if given:
            raise ConfigError(f"{flag}: a rig keeps its own joints and rest; leave {flag} out")
    wanted = kinds & set(_OF_RIGS)
    if not wanted:
        raise ConfigError(f"--rig {flags.rig}: for {', '.join(_OF_RIGS)}, and none is written")
    found = rig.read(flags.rig)
    standing(found, found.parts(flags.joint_map))
    for suffix in sorted(wanted):
        rig_files.require(suffix, flags.rig)


def write(path: Path, motion: Animation, flags: AnimationFlags) -> None:
    """Write a motion to a file of one of WRITERS, whole or not at all. Raises OSError, RigError."""
    suffix = suffix_of(path, tuple(WRITERS))
    content = WRITERS[suffix](motion, flags, suffix)
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as partial:
        partial.write_bytes(content)
    if suffix == ".bvh":
        # BVH has no place for terms: they are beside it, as the REUSE specification names the file
        terms = path.with_name(f"{path.name}.license")
        with replacing(terms) as partial:
            partial.write_text(f"{motion.clip.licence}\n{motion.clip.source}\n{existing.MARK}\n")
