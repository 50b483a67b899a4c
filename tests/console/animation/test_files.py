"""Files for animation programs by their endings, and what does not go together."""

from pathlib import Path

import numpy as np
import pytest

from console.animation import files, smpl_file
from console.animation.files import Animation
from console.commands.animation import AnimationFlags
from tests.support.console import gltf, rig_files
from tests.support.console.motions import sits
from world.errors import ConfigError


def flags(**given: object) -> AnimationFlags:
    return AnimationFlags(**given)  # pyright: ignore[reportArgumentType]


def test_the_longest_ending_counts() -> None:
    every = (".npz", *files.WRITERS)
    assert files.suffix_of(Path("a/b.smpl.npz"), every) == smpl_file.SUFFIX
    assert files.suffix_of(Path("a.NPZ"), every) == ".npz"
    assert files.suffix_of(Path("a.b.GLB"), every) == ".glb"
    for name in ("a", ".glb", "a.glbx", "glb"):
        assert files.suffix_of(Path(name), every) == ""


@pytest.mark.parametrize("suffix", files.WRITERS)
def test_every_kind_is_written_whole(tmp_path: Path, suffix: str) -> None:
    out = tmp_path / "new" / f"a{suffix}"
    files.write(out, Animation(sits()), flags())
    assert out.stat().st_size > 1000
    left = {path.name for path in out.parent.iterdir()}
    assert left == {out.name} | ({f"{out.name}.license"} if suffix == ".bvh" else set())


def test_a_clip_with_a_box_shows_it(tmp_path: Path) -> None:
    from dataclasses import replace

    from world.motions.objects import BoxTrack

    pose = np.tile(np.array([1, 2, 0.5, 1, 0, 0, 0], np.float32), (sits().frames, 1))
    boxed = replace(sits(), box=BoxTrack(pose, (0.2, 0.4, 0.6), np.zeros(sits().frames, bool)))
    files.write(tmp_path / "a.glb", Animation(boxed), flags())
    found = gltf.read(tmp_path / "a.glb")
    assert found.issues == []
    np.testing.assert_allclose(found.world(0.0)[found.node("box"), :3, 3], (2, 0.5, 1), atol=1e-6)


@pytest.mark.parametrize(
    ("given", "outs", "why"),
    [
        ({"rest": "t-pose"}, ["a.glb"], "--rest t-pose: it is the choice of a .bvh"),
        ({"rest": "hanging"}, ["a.npz"], "--rest hanging: it is the choice of a .bvh"),
        ({"root_motion": True}, ["a.smpl.npz"], "--root-motion: for .bvh, .glb, .gltf"),
        ({"joint_map": Path("m.json")}, ["a.bvh"], "--joint-map m.json: it needs --rig"),
        ({"rig": Path("r.bvh")}, ["a.smpl.npz"], "--rig r.bvh: for .bvh, .glb, .gltf"),
        ({"rig": Path("r.bvh"), "rest": "t-pose"}, ["a.bvh"], "leave --rest out"),
        ({"rig": Path("r.bvh"), "root_motion": True}, ["a.bvh"], "leave --root-motion out"),
        ({"rig": Path("r.bvh")}, ["a.bvh"], "--rig r.bvh: No such file"),
    ],
)
def test_what_does_not_go_together(given: dict, outs: list[str], why: str) -> None:  # pyright: ignore
    with pytest.raises(ConfigError) as caught:
        files.check(flags(**given), [Path(out) for out in outs])
    assert why in str(caught.value)


def test_a_rig_is_read_before_anything_is_simulated(tmp_path: Path) -> None:
    path = rig_files.bvh(tmp_path / "r.bvh", "mixamo")
    files.check(flags(rig=path), [Path("a.bvh"), Path("a.npz")])
    with pytest.raises(ConfigError, match=r"gives \.bvh files; for \.glb"):
        files.check(flags(rig=path), [Path("a.glb")])


def test_fbx_is_refused_with_the_way_round() -> None:
    with pytest.raises(ConfigError) as caught:
        files.refuse_fbx([Path("a.glb"), Path("x/b.FBX")], "--out")
    said = str(caught.value)
    assert said.startswith("--out x/b.FBX: FBX is not written") and "\n" not in said
    assert "write x/b.glb" in said and "export_scene.fbx(filepath='x/b.FBX'" in said
