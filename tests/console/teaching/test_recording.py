"""`inhabit teach record`: the clips of the teacher have all stages of a carry."""

from pathlib import Path

import numpy as np
import pytest

from console.app import main
from world.motions import load, segments
from world.motions.uses.box import BOX


def test_clips_of_the_teacher_have_every_stage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["teach", "record", str(tmp_path), "--clips", "6", "--scenes", "24"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].endswith(f" clips in {tmp_path}")
    clips = load.clips([str(tmp_path)], BOX)
    assert len(clips) >= 6
    stages = np.concatenate([segments.stages(clip) for clip in clips])
    counts = [
        (stages == s).sum() for s in (segments.APPROACH, segments.TRANSITION, segments.CONTACT)
    ]
    assert min(counts) > 30
    for clip in clips:
        assert clip.box is not None and clip.box.held.any()
        assert np.abs(clip.qvel()).max() < 40.0
