"""The text of BVH files as programs write it."""

import numpy as np
import pytest

from world.motions.formats.bvh_text import parsed

HEAD = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 3 Xposition Yposition Zposition
  JOINT Left Leg
  {
    OFFSET 0 -1 0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -2 0
    }
  }
}
MOTION
"""
ROWS = ["0 1 2 3", "4 5 6 7", "8 9 10 11", "12 13 14 15"]
VALUES = np.arange(16.0).reshape(4, 4)


def file(
    frames: str = "Frames: 4", step: str = "Frame Time: 0.1", rows: str = "\n".join(ROWS)
) -> str:
    return f"{HEAD}{frames}\n{step}\n{rows}\n"


def test_a_file_as_it_should_be() -> None:
    read = parsed(file())
    assert [(j.name, j.parent, j.offset, j.channels) for j in read.joints] == [
        ("Hips", -1, [0, 0, 0], ["px", "py", "pz"]),
        ("Left Leg", 0, [0, -1, 0], ["rx"]),
        ("Left Leg_end", 1, [0, -2, 0], []),
    ]
    np.testing.assert_array_equal(read.rows, VALUES)
    assert (read.frame_s, read.remarks) == (0.1, ())


@pytest.mark.parametrize(
    "text",
    [
        file("Frames:4", "Frame Time:0.1"),
        file("Frames :\t4", "FRAME TIME : .1"),
        file("Frames 4", "FrameTime: 1e-1"),
        file().replace("\n", "\r\n"),
        file().replace("\n", "\r"),
        file().replace("    ", "\t\t").replace("\n{", " {"),
        file().replace("\n  {", "{").replace("\n", "\n\n"),
        file().lower().replace("hips", "Hips").replace("left leg", "Left Leg"),
        file().replace("}\nMOTION", "} MOTION"),
        file().replace("End Site", "EndSite"),
        file().replace("Xposition", "XPosition").replace("Xrotation", "xRotation"),
        "# made by hand\n" + file().replace("MOTION", "// frames\nMOTION"),
        # frames over several lines, each on lines of its own, or all in one
        file(rows="0 1\n2 3\n4 5\n6\n7\n8 9 10\n11\n12 13\n14 15"),
        file(rows=" ".join(ROWS)),
        file(rows="0 1 2\n3 4 5\n6 7 8\n9 10 11\n12 13 14\n15"),
        file(rows="\n".join(ROWS) + "\n\n  \n"),
        file(rows="\n".join(row.replace(" ", ",") + ",0.5"[:0] for row in ROWS)).replace(
            "Frame Time: 0.1", "Frame Time: 0.10"
        ),
        file(step="Frame Time: 0,1", rows="\n".join(r.replace(" ", ",0 ") + ",0" for r in ROWS)),
        file(step="Frame Time: 0,1"),
        file(step="Frame Time: 1/10"),
        file(rows="\n".join(r.replace(" ", ".0D+00 ") + ".0d0" for r in ROWS)),
        file("Frames: 4.0").replace("0 -1 0", "0,0 -1,0 0,0").replace("0 -2 0", "0,0 -2 0,0"),
        file().replace("0 -1 0", "0,-1,0").replace("0 -2 0", "0, -2, 0"),
        # without line breaks, but where names end
        " ".join(file().split()).replace("Leg {", "Leg\n{").replace("Hips {", "Hips\n{"),
        " ".join(file().split()),
    ],
)  # fmt: skip
def test_other_spellings_are_the_same_file(text: str) -> None:
    read = parsed(text)
    np.testing.assert_array_equal(read.rows, VALUES)
    assert [j.name for j in read.joints] == ["Hips", "Left Leg", "Left Leg_end"]
    assert read.frame_s == pytest.approx(0.1)


@pytest.mark.parametrize("count", ["3", "5", "7", "0", "1"])
def test_a_count_that_is_off_by_a_few_is_remarked(count: str) -> None:
    read = parsed(file(f"Frames: {count}"))
    np.testing.assert_array_equal(read.rows, VALUES)
    assert read.remarks == (f"4 rows are read, the count of frames is another ({count})",)


def test_no_count_and_no_rate() -> None:
    read = parsed(file("", ""))
    np.testing.assert_array_equal(read.rows, VALUES)
    assert read.frame_s is None and "no count of frames" in read.remarks[0]


def test_the_first_of_two_skeletons_is_read() -> None:
    prop = "ROOT Ball\n{\nOFFSET 0 0 0\nCHANNELS 1 Xrotation\n}\n"
    rows = "\n".join(f"{row} 99" for row in ROWS)
    read = parsed(file(rows=rows).replace("MOTION", prop + "MOTION"))
    assert [j.name for j in read.joints] == ["Hips", "Left Leg", "Left Leg_end"]
    assert read.joints[1].first == 3 and read.rows[1, 3] == 7
    assert "left out: Ball" in read.remarks[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty"),
        ("solid cube", "does not begin with HIERARCHY"),
        (HEAD[:60], "no MOTION: the file is cut short"),
        (file("Frames: 100"), "4 rows of 100 frames: the file is cut short"),
        (file(rows="0 1 2 3\n4 5 6"), "its last frame has 3 values of 4: the file is cut short"),
        (file(rows="0 1 2\n3 4 5\n6 7 8\n0 0 0"), "a frame has 3 values, not 4"),
        (file(rows="0 1 2 3\n4 5 6 7 8\n8 9 10 11\n1 2 3"), "row 2 has 5 values, not 4"),
        (file(rows="0 1 2 3\n4 x 6 7\n8 9 10 11"), "'x' in frame 1 is no number"),
        (file().replace("CHANNELS 1", "CHANNELS 2"), "Left Leg promises 2 and names 1"),
        (file().replace("CHANNELS 1 Xrotation", "CHANNELS x"), "CHANNELS of Left Leg has no count"),
        (file().replace("OFFSET 0 -1 0", "OFFSET 0 -1"), "the OFFSET of Left Leg is not three"),
        (file().replace("}\n}\nMOTION", "}\nMOTION"), "the braces of Hips do not close"),
        (file().replace("MOTION", "}\nMOTION"), "a brace closes that never opened"),
        (file().replace("JOINT", "JIONT"), "'JIONT' after Hips: expected OFFSET"),
        (file().replace("CHANNELS 3 Xposition Yposition Zposition", "").replace(
            "CHANNELS 1 Xrotation", ""), "no joint has CHANNELS"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        parsed(text)
