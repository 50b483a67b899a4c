"""Run by Blender's Python, not by the tests': imports a file, writes its joints and objects.

blender_positions.py IN OUT.npz FRAMES NAME ... [--render FILE.png --at FRAME]
"""

import sys

import bpy  # pyright: ignore[reportMissingImports]
import numpy as np


def main(file: str, out: str, frames: int, names: list[str], picture: list[str]) -> None:
    """Positions [frames, names, 3] m, z up: of bones of the armature, else of objects."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = 30
    first = 0
    if file.endswith(".bvh"):
        # the first frame is at 1, whatever frame_start says
        bpy.ops.import_anim.bvh(filepath=file, global_scale=0.01, rotate_mode="NATIVE")
        first = 1
    elif file.endswith(".fbx"):
        bpy.ops.wm.fbx_import(filepath=file)
        first = 1
    else:
        bpy.ops.import_scene.gltf(filepath=file)
    armature = next(o for o in bpy.data.objects if o.type == "ARMATURE")
    found = np.empty((frames, len(names), 3))
    for frame in range(frames):
        scene.frame_set(first + frame)
        for column, name in enumerate(names):
            if name in armature.pose.bones:
                at = armature.matrix_world @ armature.pose.bones[name].head
            else:
                at = bpy.data.objects[name].matrix_world.translation
            found[frame, column] = at
    np.savez(out, position=found)
    if picture:
        render(scene, picture[0], first + int(picture[1]), found[int(picture[1]), 0])


def render(scene, file: str, frame: int, at: np.ndarray) -> None:
    """Draw one frame from a few metres away."""
    from mathutils import Vector  # pyright: ignore[reportMissingImports]

    scene.frame_set(frame)
    scene.render.engine, scene.cycles.samples = "CYCLES", 8
    scene.render.resolution_x = scene.render.resolution_y = 240
    bpy.ops.mesh.primitive_plane_add(size=30)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 4.0, (0.6, 0.2, 0.4)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    for one in (sun, camera):
        scene.collection.objects.link(one)
    middle = Vector((at[0], at[1], 0.8))
    camera.location = middle + Vector((1.9, -2.4, 0.5))
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    scene.camera, scene.render.filepath = camera, file
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    shown: list[str] = []
    if "--render" in words:
        at = words.index("--render")
        shown = [words[at + 1], words[at + 3]]
        words = words[:at]
    main(words[0], words[1], int(words[2]), words[3:], shown)
