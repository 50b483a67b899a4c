"""The page of clips: what it holds, and what its script computes."""

import base64
import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.motions import play
from console.motions.page import furniture, page, shown
from tests.support.console.clip_pages import data_of
from world.motions.clip import Clip
from world.motions.fit import poses
from world.motions.objects import Bed, BoxTrack, Skeleton

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def sitting(folder: Path) -> Clip:
    return next(c for c in play.clips([str(folder)], "sit") if c.seat is not None)


def test_the_page_holds_the_motion_to_a_tenth_of_a_degree(sitting: Clip) -> None:
    content = data_of(page([sitting]))["clips"][0]
    rotation = np.frombuffer(base64.b64decode(str(content["rotation"])), "<i2") / 32767.0
    rotation = rotation.reshape(-1, 15, 4)
    dot = np.abs(np.sum(rotation * sitting.local_rotation, -1)) / np.linalg.norm(rotation, axis=-1)
    assert np.degrees(2 * np.arccos(np.clip(dot, 0, 1))).max() < 0.1
    root = np.frombuffer(base64.b64decode(str(content["root_m"])), "<f4").reshape(-1, 3)
    np.testing.assert_array_equal(root, sitting.root_position_m)


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium to run the page's script in")
def test_the_script_places_hands_and_feet_where_we_do(tmp_path: Path, sitting: Clip) -> None:
    frame = 60
    probe = f"document.title = JSON.stringify(pose(unpack(DATA.clips[0]), {frame})[0]);"
    text = page([sitting]).replace("</script>", probe + "</script>")
    (tmp_path / "page.html").write_text(text)
    arguments = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=100"]
    dom = subprocess.run(
        [str(CHROMIUM), *arguments, "--dump-dom", (tmp_path / "page.html").as_uri()],
        capture_output=True,
        text=True,
        timeout=200,
    ).stdout
    found = re.search(r"<title>(.*?)</title>", dom, re.DOTALL)
    assert found is not None, dom[:500]
    place = np.array(json.loads(html.unescape(found.group(1))))
    position, _ = poses.body_poses(sitting)
    np.testing.assert_allclose(place, position[frame].numpy(), atol=1e-3)


def test_furniture_lies_under_what_uses_it(sitting: Clip) -> None:
    (seat,) = furniture(sitting)
    assert sitting.seat is not None
    height = sitting.seat.point_m[2]
    assert seat["centre_m"] == pytest.approx([*sitting.seat.point_m[:2], height / 2])
    assert seat["half_m"][2] == pytest.approx(height / 2)
    bed = Bed((1.0, 2.0, 0.4), (1.0, 2.6, 0.4), 0.0, 0, 5)
    (block,) = furniture(replace(sitting, seat=None, bed=bed))
    assert block["yaw_rad"] == pytest.approx(np.pi / 2)
    low, high = block["centre_m"][1] - 1.0, block["centre_m"][1] + 1.0
    assert low < 2.0 - 0.85 and high > 2.6 + 0.1
    assert furniture(replace(sitting, seat=None)) == []


def test_boxes_ghosts_and_names_reach_the_page(sitting: Clip) -> None:
    frames = sitting.frames
    pose = np.tile(np.array([1, 2, 0.5, 1, 0, 0, 0], np.float32), (frames, 1))
    clip = replace(
        sitting,
        name="</script><b>x",
        seat=None,
        box=BoxTrack(pose, (0.3, 0.4, 0.2), np.ones(frames, bool)),
        ghost=Skeleton(("a", "b"), (-1, 0), np.full((frames, 2, 3), 1.25, np.float32)),
    )
    content = shown(clip)
    assert content["box"]["half_m"] == pytest.approx([0.15, 0.2, 0.1])
    joints = np.frombuffer(base64.b64decode(content["ghost"]["position_mm"]), "<i2")
    assert (joints == 1250).all() and len(joints) == frames * 6
    text = page([clip])
    assert text.count("</script>") == 1
    assert data_of(text)["clips"][0]["name"] == "</script><b>x"
    assert "http" not in text.replace("http-equiv", "")
