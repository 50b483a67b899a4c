"""Acclaim by hand, and CMU's proportions."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.samp_clips import FOLDER
from tests.support.world.motion_files import AMC, ASF
from world.errors import ClipError
from world.motions.formats import acclaim, landmarks, registry
from world.motions.formats.recording import Recording

SHARED = FOLDER.parent


def test_acclaim_by_hand(tmp_path: Path) -> None:
    (tmp_path / "07.asf").write_text(ASF)
    path = tmp_path / "07_01.amc"
    path.write_text(AMC)
    read = registry.read(path)
    assert read.names == ("root", "upper", "lower", "lower_end")
    np.testing.assert_allclose(read.position[0], [[1, 2, 3], [1, 2, 3], [1, 4, 3], [4, 4, 3]])
    # upper turns by 90 about its own x, which its axis (90 about z) puts along the root's y; the
    # root then turns all by 90 about z: (0, 2, 0) stays (0, 2, 0) and goes to (-2, 0, 0);
    # (3, 0, 0) about y goes to (0, 0, -3), about z it stays
    np.testing.assert_allclose(read.position[1, 2], [-1, 2, 3], atol=1e-9)
    np.testing.assert_allclose(read.position[1, 3], [-1, 2, 0], atol=1e-9)


@pytest.mark.skipif(not (SHARED / "cmu").is_dir(), reason="no ../shared/motions")
def test_acclaim_of_cmu_has_cmus_proportions() -> None:
    read = registry.read(SHARED / "cmu" / "07_01.amc")
    joint = landmarks.find(read)
    leg = np.linalg.norm(
        read.position[:, joint["left_hip"]] - read.position[:, joint["left_knee"]], axis=-1
    ) + np.linalg.norm(
        read.position[:, joint["left_knee"]] - read.position[:, joint["left_ankle"]], axis=-1
    )
    # INDEX.csv, measured elsewhere: 0.809 m
    np.testing.assert_allclose(leg * 0.0254 / 0.45, 0.809, atol=0.001)
    assert read.frames == 316
    assert acclaim.beside(SHARED / "cmu" / "07_01.amc").name == "07.asf"


def _read(tmp_path: Path, amc: str, asf: str = ASF) -> Recording:
    (tmp_path / "07.asf").write_text(asf)
    (tmp_path / "07_01.amc").write_text(amc)
    return registry.read(tmp_path / "07_01.amc")


@pytest.mark.parametrize(
    ("header", "fps"),
    [
        (":SAMPLES-PER-SECOND 60", 60.0), (":samples-per-second 29.97", 29.97),
        (":FRAMES-PER-SECOND 30", 30.0), (":SAMPLES_PER_SECOND = 100", 100.0), ("", 120.0),
    ],
)  # fmt: skip
def test_the_stated_rate_is_obeyed(tmp_path: Path, header: str, fps: float) -> None:
    read = _read(tmp_path, f"{header}\n{AMC}")
    assert read.fps == fps
    assert read.fps_assumed is (header == "")
    assert any("frames a second" in remark for remark in read.remarks) is (header == "")


def test_a_rate_of_nothing_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match="SAMPLES-PER-SECOND states no rate above 0"):
        _read(tmp_path, f":SAMPLES-PER-SECOND 0\n{AMC}")


def _radians(text: str) -> str:
    """The frames of AMC with their angles in radians."""
    return text.replace(" 90", f" {np.pi / 2:.12f}")


def test_the_motions_unit_of_angles_is_its_own(tmp_path: Path) -> None:
    expected = _read(tmp_path, AMC)
    # stated by the motion alone: the skeleton's axes stay in degrees
    stated = _radians(AMC).replace(":DEGREES", ":RADIANS")
    np.testing.assert_allclose(_read(tmp_path, stated).position, expected.position, atol=1e-9)
    # stated by the skeleton alone: both are radians
    asf = ASF.replace("angle deg", "angle rad").replace("axis 0 0 90", f"axis 0 0 {np.pi / 2}")
    unstated = _radians(AMC).replace(":DEGREES\n", "")
    np.testing.assert_allclose(
        _read(tmp_path, unstated, asf).position, expected.position, atol=1e-9
    )
    # the skeleton's radians, the motion's degrees
    np.testing.assert_allclose(_read(tmp_path, AMC, asf).position, expected.position, atol=1e-9)


def test_rows_of_bones_without_freedom_move_nothing(tmp_path: Path) -> None:
    expected = _read(tmp_path, AMC)
    listed = "\n".join(
        line + ("\nlower 0 0 0" if line.startswith("upper") else "") for line in AMC.splitlines()
    )
    read = _read(tmp_path, listed)
    np.testing.assert_array_equal(read.position, expected.position)
    assert not read.approximated
    moved = _read(tmp_path, listed.replace("lower 0 0 0", "lower 0 5 0"))
    np.testing.assert_array_equal(moved.position, expected.position)
    assert moved.approximated == (
        "values of bones without dof in the skeleton are left out: lower",
    )


def test_bones_that_translate_and_lengthen(tmp_path: Path) -> None:
    asf = ASF.replace("dof rx rz", "dof tx ty tz rx rz l")
    amc = AMC.replace("upper 0 0", "upper 1 2 3 0 0 0").replace("upper 90 0", "upper 1 0 0 90 0 4")
    read = _read(tmp_path, amc, asf)
    # the axes of upper are turned by 90 degrees about z: its (1, 2, 3) is the root's (-2, 1, 3)
    np.testing.assert_allclose(
        read.position[0], [[1, 2, 3], [-1, 3, 6], [-1, 5, 6], [2, 5, 6]], atol=1e-9
    )
    # the root's 90 degrees about z take its (1, 0, 0) = (0, 1, 0) to (-1, 0, 0), and the length of
    # 2 + 4 along (0, 1, 0) to (-6, 0, 0)
    np.testing.assert_allclose(read.position[1, 1], [0, 2, 3], atol=1e-9)
    np.testing.assert_allclose(read.position[1, 2], [-6, 2, 3], atol=1e-9)


def test_the_skeletons_unit_holds_where_it_makes_a_person() -> None:
    for length, unit in (("0.45", 0.0254 / 0.45), ("1.0", 0.0254)):
        skeleton = acclaim._skeleton(ASF.replace("length 0.45", f"length {length}"))
        assert skeleton.unit_m == pytest.approx(unit)


def test_a_root_without_some_axes_is_where_the_skeleton_says(tmp_path: Path) -> None:
    asf = ASF.replace("order TX TY TZ RX RY RZ", "order TX RZ").replace(
        "position 0 0 0", "position 0 5 6"
    )
    amc = ":DEGREES\n1\nroot 1 0\nupper 0 0\n2\nroot 2 90\nupper 0 0\n"
    read = _read(tmp_path, amc, asf)
    np.testing.assert_allclose(read.position[:, 0], [[1, 5, 6], [2, 5, 6]])
    # (0, 2, 0) turned by 90 degrees about z
    np.testing.assert_allclose(read.position[1, 2], [0, 5, 6], atol=1e-9)


def test_a_skeleton_that_is_a_pointer_is_called_that(tmp_path: Path) -> None:
    with pytest.raises(ClipError, match=r"07_01.amc: its skeleton .*07.asf .*Git LFS pointer"):
        _read(tmp_path, AMC, "version https://git-lfs.github.com/spec/v1\n")


_WRAPPED = "root 1 2 3\n  0 0\n90"


@pytest.mark.parametrize(
    ("amc", "asf"),
    [
        (AMC.replace("root 1 2 3 0 0 90", _WRAPPED), ASF),
        (AMC.replace("root 1 2 3 0 0 90", "root\n1\n2\n3\n0\n0\n90"), ASF),
        (AMC.replace("root 1 2 3 0 0 90", "root 1 2 3 \\\n 0 0 90"), ASF),
        (AMC.replace("upper 0 0", "upper 0 0 # here").replace("\n2\n", "\n2 # second\n"), ASF),
        (AMC.replace("1 2 3", "1,0 2,0 3,0"), ASF),
        (AMC.replace("1 2 3", "1e0 2E0 3D0"), ASF),
        (AMC.replace("root", "Root").replace("upper", "UPPER"), ASF),
        (AMC + "\r\n\x1a", ASF + "\0\0"),
        ("# take \x85 1 2\n" + AMC, "# take\u2028 x\n" + ASF),
        (AMC, ASF.replace("dof rx rz", "dof rx\n  rz\n limits (-20 20)\n   (-5 5)")),
        (AMC, ASF.replace("direction 0 1 0", "direction 0\n 1 0")),
        (AMC, ASF.replace("     axis 0 0 0 XYZ\n", "")),
        (AMC, ASF.replace("root upper", "Root Upper")),
        (AMC, ASF.replace("name upper", 'name "upper"')),
        (AMC, ASF.replace(":root", ":documentation\n made: by\n :) us\n:root", 1)),
        (AMC, ":hierarchy" + ASF.split(":hierarchy")[1] + ASF.split(":hierarchy")[0]),
        (_radians(AMC).replace(":DEGREES", ":RADIAN # unit"), ASF),
        (_radians(AMC).replace(":DEGREES", ":ANGLE RADIANS"), ASF),
    ],
)  # fmt: skip
def test_what_programs_write_is_the_same_motion(tmp_path: Path, amc: str, asf: str) -> None:
    expected = _read(tmp_path, AMC)
    read = _read(tmp_path, amc, asf)
    assert read.names == expected.names
    np.testing.assert_allclose(read.position, expected.position, atol=1e-9)


def test_units_on_one_line_are_obeyed() -> None:
    asf = ASF.replace(":units\n  mass 1.0\n  length 0.45\n  angle deg", ":units length 1 angle rad")
    skeleton = acclaim._skeleton(asf)
    assert not skeleton.degrees and skeleton.unit_m == pytest.approx(0.0254)


@pytest.mark.parametrize(
    ("header", "fps"),
    [
        (":SAMPLES PER SECOND 60", 60.0), (":FRAMERATE 60", 60.0), (":FRAME-RATE: 60 Hz", 60.0),
        (":SAMPLES-PER-SECOND 60fps # rate", 60.0), (":FRAME-TIME 0.02", 50.0),
        (":samples-per-second 59,94", 59.94),
    ],
)  # fmt: skip
def test_other_spellings_of_the_rate(tmp_path: Path, header: str, fps: float) -> None:
    read = _read(tmp_path, f"{header}\n{AMC}")
    assert read.fps == pytest.approx(fps) and not read.fps_assumed


def test_absent_frames_are_filled_in_between_their_neighbours(tmp_path: Path) -> None:
    rows = {1: (0, 170), 2: (1, 175), 5: (4, -170), 6: (5, -165)}
    amc = ":DEGREES\n" + "".join(f"{n}\nroot {x} 0 0 0 0 {z}\nupper 0 0\n" for n, (x, z) in
                                rows.items())  # fmt: skip
    read = _read(tmp_path, amc)
    assert read.approximated == ("2 absent frames are filled in between their neighbours",)
    np.testing.assert_allclose(read.position[:, 0, 0], range(6), atol=1e-9)
    # 175, 180, 185 and 190 degrees, not back through 0: the tip of upper, (0, 2, 0), is below
    turns = np.deg2rad([170, 175, 180, 185, 190, 195])
    np.testing.assert_allclose(read.position[:, 2, 1], 2 * np.cos(turns), atol=1e-9)
    with pytest.raises(ClipError, match=r"07_01.amc: no frame between 2 and 50"):
        _read(tmp_path, amc.replace("\n5\n", "\n50\n").replace("\n6\n", "\n51\n"))


def test_bones_without_rows_stay_at_rest(tmp_path: Path) -> None:
    read = _read(tmp_path, AMC.replace("upper 0 0\n", "").replace("upper 90 0\n", ""))
    assert read.approximated == ("bones without values in the motion stay at rest: upper",)
    np.testing.assert_allclose(read.position[1, 2], [-1, 2, 3], atol=1e-9)


@pytest.mark.parametrize(
    ("amc", "asf", "said"),
    [
        (AMC.replace("upper 0 0\n", "upper 0 0 0\n"), ASF, "3 values of upper, not 2: the skel"),
        (AMC.replace("2\nroot", "root"), ASF, "frame 1 has two rows of root"),
        ("root 1 2 3 0 0 0\n" + AMC, ASF, "'root' before the number of the first frame"),
        (AMC, ASF.replace("upper lower", "upper lower\n lower upper"), "of lower is a loop"),
        (AMC, ASF.replace("upper lower", "upper lower\n lower root"), "of root is a loop"),
        (AMC, ASF.replace("name lower", "name upper"), "two bones have the name upper"),
        (AMC, ASF.replace("direction 0 1 0", "direction 1"), "direction of bone upper is not thr"),
        (AMC, ASF.replace("length 2", ""), "bone upper has no length"),
        (AMC, ASF.replace("order TX TY TZ RX RY RZ", ""), ":root has no order"),
    ],
)  # fmt: skip
def test_faults_are_named(tmp_path: Path, amc: str, asf: str, said: str) -> None:
    with pytest.raises(ClipError, match=said):
        _read(tmp_path, amc, asf)


def test_a_skeleton_of_very_many_bones_is_refused(tmp_path: Path) -> None:
    many = "".join(
        f"begin\nname b{i}\ndirection 0 1 0\nlength 1\nend\n" for i in range(acclaim.MAX_BONES)
    )
    with pytest.raises(ClipError, match="bones; at most 2000 are read"):
        _read(tmp_path, AMC, ASF.replace(":hierarchy", many + ":hierarchy"))


def test_a_skeleton_that_is_no_file_is_not_opened(tmp_path: Path) -> None:
    (tmp_path / "07_01.amc").write_text(AMC)
    (tmp_path / "07.asf").symlink_to("/dev/zero")
    with pytest.raises(ClipError, match=r"its skeleton .*07.asf .*a pipe or a device, not a file"):
        registry.read(tmp_path / "07_01.amc")


def test_the_skeleton_of_the_longest_name_is_beside(tmp_path: Path) -> None:
    for name in ("HDM_bd", "HDM_bk", "HDM", "subject7", "subject70"):
        (tmp_path / f"{name}.asf").touch()
    for motion, skeleton in (
        ("HDM_bd_01-01_120", "HDM_bd"), ("HDM_mm_02", "HDM"), ("subject7-walk", "subject7"),
        ("SUBJECT70", "subject70"),
    ):  # fmt: skip
        assert acclaim.beside(tmp_path / f"{motion}.amc").stem == skeleton
    with pytest.raises(ClipError, match=r"no skeleton walk.asf beside it \(found: HDM.asf"):
        acclaim.beside(tmp_path / "walk_1.amc")
