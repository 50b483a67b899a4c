"""`inhabit bench films`: its figures agree with each other, and films do not differ."""

import math

import pytest

from console.bench import films, meanings
from console.recording.format import Recording
from console.video import rendering
from tests.support.console.recordings import take


@pytest.mark.skipif(rendering.choose_gl() is None, reason="nothing draws offscreen here")
def test_the_figures_of_a_short_film() -> None:
    rendering.require_gl()
    found = films.of_recording(Recording([take(8)], {}), 0.0, 2)
    assert found["differing_films"] == 0.0 and found["images"] == 8.0
    assert found["processes_count"] == 1.0, "eight images are not worth a second process"
    ratio = found["images_per_s"] / found["one_process_images_per_s"]
    assert math.isclose(found["to_one_process_ratio"], ratio)
    quiet = found["quiet_images_per_s"] * found["processor_ms_per_image"]
    assert math.isclose(quiet, 1e3 * found["processes_count"])
    assert found["draw_processor_ms_per_image"] > 0.0 and found["film_resident_gb"] > 0.05


def test_the_limit_is_that_of_quiet_cores() -> None:
    figures = {"quiet_images_per_s": 61.0, "goal_images_per_s": films.GOAL_IMAGES_PER_S}
    assert meanings.verdict("quiet_images_per_s", figures) == "met: at least 60"
    figures["quiet_images_per_s"] = 59.0
    assert meanings.verdict("quiet_images_per_s", figures) == "MISSED: at least 60"
    assert meanings.verdict("differing_films", {"differing_films": 1.0}) == "MISSED: at most 0"
