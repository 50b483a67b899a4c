"""Style transitions are drawn by counter, and some are held out."""

import pytest
import torch

from tests.support.learning.recordings import counted_reads
from world import tasks
from world.motions import load
from world.motions.clip import Clip
from world.motions.library import MotionLibrary, StyleMixture, StyleSource

MIXTURE = StyleMixture()


def test_style_source_is_drawn_by_counter_and_holds_out(sitting: Clip) -> None:
    library = MotionLibrary([*load.own_clips()[:12], sitting])
    source = StyleSource(library, 3, MIXTURE)
    first, again = source.sample(256, 5), source.sample(256, 5)
    assert torch.equal(first[0], again[0])
    assert torch.equal(first[1], again[1])
    assert not torch.equal(first[0], source.sample(256, 6)[0])
    trained = set(library.upright.tolist()).union(*(p.tolist() for p in library.stages))
    assert not trained & set(library.held_out.tolist())
    state, following = source.held_out(256, 5)
    assert state.isfinite().all()
    # one control step apart: the root moves by less than a tenth of a metre
    assert (state[:, 0] - following[:, 0]).abs().max() < 0.1


@pytest.mark.parametrize("task", ["sit", "carry"])
def test_drawing_transitions_waits_for_no_device(task: str) -> None:
    clips = load.own_clips()[::12]
    source = StyleSource(MotionLibrary(clips, use=tasks.make(task).affordance.clips), 3, MIXTURE)
    with counted_reads() as found:
        source.sample(64, 5)
    assert found == []
