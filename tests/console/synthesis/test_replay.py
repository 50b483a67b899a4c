"""The page of a motion: self-contained, with the recorded poses and curves."""

import base64
import json
import re
from pathlib import Path

import numpy as np

from console.recording import format as recording


def test_the_page_needs_nothing_but_itself(files: dict[str, Path]) -> None:
    text = files[".html"].read_text()
    assert not re.search(r"https?://|<link|\bsrc=|@import|url\(", text)
    held = re.search(r'id="takes">(.*?)</script>', text)
    assert held is not None
    (shown,) = json.loads(held[1].replace("<\\/", "</"))
    take = recording.read(files[".msgpack"]).takes[0]
    poses = np.frombuffer(base64.b64decode(shown["poses"]), "<i2")
    poses = poses.reshape(len(take), shown["bodies"], 7)
    np.testing.assert_allclose(poses[:, shown["root"], :3] / 1000, take.qpos[:, :3], atol=6e-4)
    assert shown["frames"] == len(take) and not shown["fell"]
    assert "none: the checkpoint has no discriminator" in text and "and held" in text
    assert text.count('class="chart"') == 3
