"""BVH channels in any order and at every joint."""

from pathlib import Path

import numpy as np

from tests.support import foreign_motions
from world.motions.clip import Clip
from world.motions.formats import registry


def test_bvh_with_position_channels_everywhere(tmp_path: Path, walking: Clip) -> None:
    plain = foreign_motions.bvh_of(tmp_path / "a.bvh", walking)
    lines = plain.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Frame Time"))
    head = [
        line.replace("CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition")
        for line in lines[: start + 1]
    ]
    frames: list[list[str]] = []
    for line in lines[start + 1 :]:
        values = line.split()
        frames.append(values[:6])
        for joint in range(6, len(values), 3):
            frames[-1] += ["1", "2", "3", *values[joint : joint + 3]]
    other = tmp_path / "b.bvh"
    other.write_text("\n".join([*head, *(" ".join(f) for f in frames)]) + "\n")
    read = registry.read(other)
    np.testing.assert_array_equal(read.position, registry.read(plain).position)
    assert "bones keep their lengths" in read.approximated[0]
