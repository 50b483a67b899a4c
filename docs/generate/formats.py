"""The page of file formats: keys, shapes and meanings; a test compares the keys with real files."""

from dataclasses import dataclass

from console.recording import format as recording
from docs.generate.markdown import code, table
from policy.checkpoints import format as checkpoint
from world.meshes import store


@dataclass(frozen=True)
class Format:
    """One kind of file."""

    title: str
    about: str
    keys: tuple[tuple[str, str, str], ...]
    """Key, shape or type, meaning."""


CLIP = Format(
    "Motion clip (`.npz`)",
    "Numpy arrays without pickles. `inhabit motions import` writes it, and the SAMP conversion has"
    " the first four keys. Bodies are in the order of [features](features.md); frames are at `fps`;"
    " the floor is at z = 0.",
    (
        ("fps", "scalar", "frames per second"),
        ("root_position_m", "[T, 3] float32", "position of the root, world, m"),
        (
            "local_rotation_wxyz",
            "[T, 15, 4] float32",
            "rotation of each body in its parent's frame (the root's in the world)",
        ),
        ("body_names", "[15] text", "names of the bodies"),
        (
            "about",
            "JSON text",
            "name, source, licence; seat, bed and box_size_m where the motion uses them; names and"
            " parents of the ghost",
        ),
        ("box_pose", "[T, 7]", "position and rotation of the carried box; only with a box"),
        ("box_held", "[T] bool", "whether the hands hold it; only with a box"),
        ("ghost_m", "[T, J, 3]", "joint positions of the recorded skeleton; only with a ghost"),
    ),
)
PIECE = Format(
    f"Piece of furniture (`{store.SUFFIX}`)",
    "JSON, one piece per file, written by `inhabit objects import`. Frame: metres, z up, +x the"
    " front, origin on the floor below the centre of the bounding box.",
    (
        ("format", "text", f"`{store.FORMAT}`"),
        ("version", "number", f"{store.VERSION}"),
        ("name", "text", "name of the piece"),
        ("category", "text", "its class: chair, sofa, ..."),
        ("size_m", "[3]", "edge lengths of the bounding box"),
        ("mass_kg", "number", "mass"),
        ("centre_of_mass_m", "[3]", "centre of mass"),
        ("inertia_kg_m2", "[3, 3]", "inertia about the centre of mass"),
        ("licence", "text", "terms of use"),
        ("credit", "text", "author, where the licence asks for it"),
        (
            "sit",
            "list",
            "seats, each with point_m [3], facing_rad, seat_m (height of the seat where it is above"
            " the point, else null), and rests_at: the scales at which a ragdoll comes to rest"
            " there",
        ),
        ("lie", "object or null", "lying place: hip_m [3] and head_m [3] on the surface"),
        ("seat_error_m", "number or null", "height of the hulls against the mesh at the seat"),
        ("notes", "list", "remarks of the import: what was left out, or decided against the name"),
        ("source", "object", "file name and sha256 of the mesh"),
        ("hulls", "list", "convex hulls, each with vertices_m and faces (triangles)"),
    ),
)
RECORDING = Format(
    "Recording (`.msgpack`)",
    "MessagePack with one extension type (1) for arrays: dtype, shape, little-endian numbers. At"
    f" its top: format `{recording.FORMAT}`, version {recording.VERSION}, meta (task, control_hz,"
    " checkpoint, ...), and takes, a list. Each take has, for T control steps in the world frame:",
    (
        ("qpos", "[T, 43 or 50]", "generalised coordinates; with a box, its pose follows"),
        ("qvel", "[T, nv]", "generalised velocities"),
        ("ctrl", "[T, 28]", "set-points of the servos, rad"),
        ("mocap_pos", "[T, 3]", "position of the furniture (or of the box's first stand)"),
        ("mocap_quat", "[T, 4]", "rotation of the furniture"),
        ("boxes", "[k, 10]", "its shape, scaled: centre, half edges and rotation of each box"),
        ("balls", "[T, k, 3]", "projectiles; NaN while they are not in the scene"),
        ("cargo", "[3] or [0]", "half edges of the carried box"),
        ("stand", "[3] or [0]", "centre of the top of the stand at the box's target"),
        ("ghost", "[T, 43] or [0, 43]", "coordinates of the reference that is followed"),
        ("piece", "text", "name of the piece"),
        ("scale", "number", "its scale"),
        ("meta", "object", "of the take: seed, trial, result"),
    ),
)
CHECKPOINT = Format(
    f"Checkpoint (folder with `{checkpoint.MANIFEST}`)",
    "One safetensors file per section (policy, training, style) and a JSON manifest. Nothing is"
    " pickled. A published policy has the section `policy` alone, with the networks `actor`,"
    " `average` (the averaged actor, which acts in evaluation and serving) and `critic`, and the"
    " moments `normaliser` and `values`. Keys of the manifest:",
    (
        ("format", "number", f"{checkpoint.FORMAT}"),
        (
            "layout",
            "object",
            "task, features and goal as [name, width] pairs, actions, hidden widths, skip",
        ),
        ("iteration", "number", "PPO iterations"),
        ("samples", "number", "control steps over all scenes"),
        ("notes", "object", "the experiment as JSON, data, licence, evaluation"),
        ("files", "object", "sha256 and bytes of each file"),
        ("values", "object", "values that are no tensors, by section and path"),
        ("sha256", "text", "digest of the manifest without this key"),
    ),
)
RUN = Format(
    "Run directory",
    "Output of `inhabit train`.",
    (
        ("config.json", "file", "task, experiment, machine, command line"),
        ("metrics.jsonl", "file", "one line per iteration: [metrics](metrics.md)"),
        ("tensorboard", "folder", "the same as TensorBoard events"),
        (
            "checkpoints",
            "folder",
            "`NNNNNN/` by iteration, and the links `latest` and `best`",
        ),
        ("evaluations", "folder", "JSON of `inhabit evaluate`"),
        (
            "before",
            "folder",
            "runs that its recipe makes before it, and the names of the complete ones",
        ),
        ("recordings", "folder", "NaN dumps: the steps before a scene became non-finite"),
    ),
)
PAGE = (CLIP, PIECE, RECORDING, CHECKPOINT, RUN)


def page() -> str:
    """All formats."""
    parts = ["# File formats\n", "Lengths are in metres, quaternions are w, x, y, z.\n"]
    for kind in PAGE:
        rows = ((code(key), shape, meaning) for key, shape, meaning in kind.keys)
        parts += [f"## {kind.title}\n", kind.about + "\n", table(("key", "shape", "meaning"), rows)]
    return "\n".join(parts)
