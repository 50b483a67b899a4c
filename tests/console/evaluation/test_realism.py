"""Motion quality's parts: clips without their mirrors, and figures of overlaps and distances."""

from pathlib import Path

import numpy as np
import pytest
import torch

from console.evaluation import realism
from tests.support import small_clips
from world.motions import load


def test_mirror_images_are_no_clips_of_their_own(tmp_path: Path) -> None:
    library = load.library([str(small_clips.write(tmp_path))], mirror=True)
    motions, labels = realism.clips_of(library)
    plain = [clip for clip in library.clips if not clip.name.endswith("~mirrored")]
    assert len(plain) == len(library.clips) / 2 == len(set(labels)) == len(motions)
    assert [len(motion.qpos) for motion in motions] == [clip.frames for clip in plain]


def test_overlaps_by_hand() -> None:
    found = realism._overlap_figures(np.array([0.0, 0.0, 0.01, 0.03]))
    assert found["furniture_overlap_m"] == pytest.approx(0.02)
    assert found["furniture_overlap_p99_m"] == pytest.approx(np.percentile([0, 0, 0.01, 0.03], 99))
    assert set(realism._overlap_figures(np.zeros(0)).values()) == {None}
    assert realism._overlap_figures(np.zeros(3))["furniture_overlap_m"] is None


def test_distances_by_hand() -> None:
    found = realism._summary(torch.tensor([1.0, 2.0, 3.0, float("inf")]))
    assert found == {"median": 2.0, "p95": pytest.approx(2.9)}
    assert realism._summary(torch.tensor([float("inf")])) == {}
    assert realism._spread(5, 100).tolist() == [0, 1, 2, 3, 4]
    assert realism._spread(101, 3).tolist() == [0, 50, 100]
