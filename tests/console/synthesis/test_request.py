"""Requests of the command line, and what is wrong with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.synthesis import request as scene_request
from tests.support.console.syntheses import command, made
from tests.support.paths import ROOT
from tests.support.policy_cases import make
from world import tasks
from world.furniture.catalogue import find

SIT = str(ROOT / "pretrained" / "sit")


def test_lying_has_a_bed_to_either_side() -> None:
    served = make(1, "lie", "lie")
    starts = [made(served, command("lie", "bed-test-002", seconds=0.1, place=i)) for i in (0, 1)]
    facings = [motion.targets[0].facing[0].numpy() for motion in starts]
    np.testing.assert_allclose(facings[0], -facings[1], atol=1e-5)
    # frames of success, as a policy that lies there would have them
    good = starts[0]
    for frame in good.frames[1:]:
        frame.success = True
    bed = good.clip().bed
    lie = find("bed-test-002").lie
    assert bed is not None and lie is not None and (bed.from_frame, bed.to_frame) == (1, 4)
    np.testing.assert_allclose(bed.hip_m, lie.hip_m, atol=1e-5)
    np.testing.assert_allclose(bed.head_m[:2], lie.head_m[:2], atol=1e-5)


WRONG = [
    ("--object chiar-test-000 --out a.npz", "nearest names are chair-test-000, "),
    ("--object none.glb --out a.npz", "none.glb"),
    ("--object high-stool-test-000 --scale 9 --out a.npz", "--scale 9: must be 0.2 to 5"),
    ("--object chair-test-000 --scale 99 --out a.npz", "--scale 99: must be 0.2 to 5"),
    ("--object table-test-000 --out a.npz", "has no place to sit"),
    ("--object chair-test-000 --place 1 --out a.npz", "--place 1: chair-test-000 has 1"),
    ("--object chair-test-000 --start 1,2 --out a.npz", "--start 1,2: give X,Y,YAW"),
    ("--object chair-test-000 --start a,b,c --out a.npz", "--start a,b,c: give X,Y,YAW"),
    ("--object chair-test-000 --start 1,inf,2 --out a.npz", "--start 1,inf,2: each number"),
    (
        "--object chair-test-000 --start 0,0,90 --out a.npz",
        "--start 0,0,90: the character would stand in chair-test-000, which reaches from -0.25 to",
    ),
    (
        "--object bed-test-002 --at 2,0,90 --start 2,0.9,0 --out a.npz",
        "from -1.01 to 1.01 m in Y: choose a point outside",
    ),
    ("--object high-stool-test-000 --start 0,0,180 --out a.npz", "would stand in high-stool-test"),
    (
        "--object chair-test-000 --seconds 601 --out a.npz",
        "--seconds 601: must be 0.0333333 to 600",
    ),
    ("--object chair-test-000 --seconds 0 --out a.npz", "--seconds 0: must be 0.0333333 to 600"),
    ("--object chair-test-000 --tries 0 --out a.npz", "--tries 0: must be 1 to 10000"),
    ("--object chair-test-000 --seed -1 --out a.npz", "--seed -1: must be 0 to"),
    (
        "--object chair-test-000 --to 1,2,0.5 --out a.npz",
        "--to 1,2,0.5: the task sit uses none; leave it out",
    ),
    (
        "--object chair-test-000 --stand-m 0.3 --out a.npz",
        "--stand-m 0.3: the task sit uses none; leave it out",
    ),
    (
        "--object chair-test-000 --out a.abc",
        "'.abc'; choose .npz, .glb, .gltf, .bvh, .smpl.npz, .html, .mp4, .msgpack",
    ),
    ("--object chair-test-000 --out a.fbx", "--out a.fbx: FBX is not written"),
    ("--object chair-test-000 --rest t-pose --out a.glb", "--rest t-pose: it is the choice of"),
    ("--object chair-test-000 --rig no.bvh --out a.bvh", "--rig no.bvh: no such file or folder"),
    ("--object chair-test-000 --out a", "--out a: no suffix; choose .npz"),
    ("--object chair-test-000 --out a.bvh a.bvh", "names one file twice"),
    ("--object chair-test-000 --out there.bvh", "there.bvh exists: name another file, or add"),
    ("--object chair-test-000 --out there.bvh/a.bvh", "there.bvh is not a writable folder"),
    ("--object chair-test-000", "--out"),
    ("--out a.npz", "--object"),
    (
        "--object chair-test-000 --perturb rain --out a.npz",
        "choose one of none, projectiles, moved",
    ),
]


@pytest.mark.parametrize(("words", "named"), WRONG, ids=[words for words, _ in WRONG])
def test_one_line_names_what_is_wrong(
    words: str,
    named: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.bvh").write_text("mine")
    assert main(["synthesize", SIT, *words.split()]) in (1, 2)
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and named in said
    assert (tmp_path / "there.bvh").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["there.bvh"], "nothing is left"


def test_a_start_beside_a_piece_is_taken() -> None:
    """Its front edge is at 0.25 m, and a character takes less than 0.15 m."""
    for start in ("0.4,0,180", "0.4,0,0", "-0.4,0,0"):
        scene_request.scene(command("sit", "chair-test-000", start=start), tasks.make("sit"), None)
    at = command("sit", "chair-test-000", start="0,0,0", at="1,1,45")
    scene_request.scene(at, tasks.make("sit"), None)


def test_what_carry_needs_is_named() -> None:
    carry = tasks.make("carry")

    def said(**flags: object) -> str:
        with pytest.raises(Exception, match="--") as caught:
            scene_request.scene(replace(command("carry", "box"), **flags), carry, None)  # pyright: ignore
        return str(caught.value)

    assert "--to X,Y,HEIGHT: give the target" in said()
    assert "give --object box" in said(object="chair-test-000")
    assert "--to's HEIGHT 9: choose" in said(to="1,2,9")
    assert "--box-kg 500: choose" in said(to="1,2,0.5", box_kg=500.0)
    assert "--scale 9: choose 0.167 to 4" in said(to="1,2,0.5", scale=9.0)
