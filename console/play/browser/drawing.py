"""Bodies of a model as nodes of viser's scene, moved together."""

from typing import Any

import mujoco
import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from console.report.scene3d import shapes_of
from console.video.stage import GHOST, Shapes

#: Digits to which colours are compared.
_DIGITS = 3


def mesh_of(shape: dict[str, Any]) -> trimesh.Trimesh:
    """Return a shape of `shapes_of` as a triangle mesh, in its body's frame."""
    size, kind = shape["size"], shape["kind"]
    if kind == "sphere":
        found = trimesh.creation.icosphere(subdivisions=2, radius=size[0])
    elif kind == "ellipsoid":
        found = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
        found.apply_scale(size)
    elif kind == "capsule":
        found = trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=(12, 16))
        # the capsule of some versions of trimesh starts at the origin, MuJoCo's is centred
        found.apply_translation(-found.bounds.mean(axis=0))
    elif kind == "cylinder":
        found = trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=24)
    elif kind == "box":
        found = trimesh.creation.box(extents=[2 * edge for edge in size])
    else:
        found = trimesh.Trimesh(
            np.reshape(shape["vertices"], (-1, 3)), np.reshape(shape["faces"], (-1, 3))
        )
    if kind in ("box", "mesh"):
        # edges stay sharp if triangles share no vertices
        found.unmerge_vertices()
    place = trimesh.transformations.quaternion_matrix(shape["quat"])
    place[:3, 3] = shape["pos"]
    return found.apply_transform(place)


class Drawn:
    """The bodies of a model below one node."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        model: mujoco.MjModel,
        piece: str = "",
        look: Shapes = "body",
        ghost: bool = False,
    ) -> None:
        """piece, look: see console.report.scene3d.shapes_of. ghost: in one colour, transparent,
        without a shadow."""
        self._server = server
        self._root = server.scene.add_frame(name, show_axes=False)
        shapes, self._bodies = shapes_of(model, piece, look)
        self._nodes = [
            server.scene.add_frame(f"{name}/body{body}", show_axes=False) for body in self._bodies
        ]
        parts: dict[tuple[int, tuple[float, ...]], list[trimesh.Trimesh]] = {}
        for shape in shapes:
            colour = GHOST[:3] if ghost else tuple(round(c, _DIGITS) for c in shape["rgb"])
            parts.setdefault((shape["body"], colour), []).append(mesh_of(shape))
        for number, ((body, colour), meshes) in enumerate(parts.items()):
            whole = trimesh.util.concatenate(meshes)
            server.scene.add_mesh_simple(
                f"{name}/body{self._bodies[body]}/part{number}",
                np.asarray(whole.vertices, np.float32),
                np.asarray(whole.faces, np.uint32),
                color=(colour[0], colour[1], colour[2]),
                opacity=GHOST[3] if ghost else None,
                cast_shadow=not ghost,
                receive_shadow=not ghost,
            )

    def put(self, poses: NDArray[np.float64]) -> None:
        """Move the bodies: [nbody, 7], positions m and rotations (w, x, y, z); bodies with
        positions NaN are hidden."""
        for node, body in zip(self._nodes, self._bodies, strict=True):
            position = poses[body, :3]
            there = bool(np.isfinite(position).all())
            if node.visible != there:
                node.visible = there
            if there:
                node.position, node.wxyz = position, poses[body, 3:]

    def show(self, visible: bool) -> None:
        """Show or hide all bodies."""
        self._root.visible = visible

    def remove(self) -> None:
        """Remove all bodies from the scene."""
        self._root.remove()
