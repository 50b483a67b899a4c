"""Evaluation of following clips: trials, figures by hand, and takes with the reference beside."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.evaluation.tracking import Outcomes, Trials, manifest, run, summary
from console.play.recorded import takes_of
from console.recording import format as recording
from console.recording.format import Recording
from tests.support.track_scenes import WORLD, bank, followed


def test_trials_take_the_clips_in_turn_and_then_each_from_its_start() -> None:
    chosen = manifest(bank(), 41, 3)
    clip = followed().clip[chosen.frame].tolist()
    assert clip[:41] == [i % 4 for i in range(41)]
    assert clip[41:] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert chosen.whole.tolist() == [False] * 41 + [True] * 8
    assert (followed().start_weight[chosen.frame] > 0).all()
    assert (chosen.frame[:41] != manifest(bank(), 41, 4).frame[:41]).any()


def test_figures_are_the_same_on_any_number_of_threads_and_takes_show_the_reference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # several chunks, and scenes that begin anew
    monkeypatch.setattr("console.evaluation.tracking.CHUNK", 12)
    monkeypatch.setattr("console.evaluation.tracking.SLOTS", 5)
    chosen = manifest(bank(), 16, 0)
    one, two = (run(WORLD, bank(), None, chosen, threads, record=3) for threads in (1, 2))
    for name in ("completed", "ends", "steps", "deviation", "contact"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    assert (one.completed ^ one.ends.any(axis=1)).all()
    left = followed().stop[followed().clip[chosen.frame]].numpy() - 1 - chosen.frame
    assert (one.steps <= left).all()
    assert (one.steps[one.completed] == left[one.completed]).all()
    for trial, take in enumerate(one.takes):
        assert len(take) == one.steps[trial]
        # it begins in the reference's own state, a little higher
        assert np.abs(take.ghost[0] - take.qpos[0, :43]).max() < 0.07
        along = followed().qpos[chosen.frame[trial] :][: len(take)].numpy()
        assert np.allclose(take.ghost[:, 2:], along[:, 2:])
        assert np.allclose(take.ghost[:, :2], along[:, :2] - along[0, :2], atol=1e-5)
    recording.write(tmp_path / "a.msgpack", Recording(one.takes, {}))
    again = recording.read(tmp_path / "a.msgpack")
    assert np.array_equal(again.takes[1].ghost, one.takes[1].ghost)


def test_no_more_trials_are_recorded_than_there_are() -> None:
    chosen = Trials(np.zeros(2, np.int64), np.zeros(2), np.array([False, False]))
    frame = np.flatnonzero(followed().start_weight.numpy() > 0)[:2]
    found = run(WORLD, bank(), None, replace(chosen, frame=frame), 1, record=8)
    assert [len(take) for take in found.takes] == found.steps.tolist()


def test_figures_by_hand() -> None:
    outcomes = Outcomes(
        completed=np.array([True, False, True, True]),
        ends=np.array([[False] * 4, [False, False, True, False], [False] * 4, [False] * 4]),
        steps=np.array([10, 30, 20, 5]),
        deviation=np.array([[0.1, 0.2, 0.03], [0.2, 0.2, 0.11], [0.05, 0.1, 0.0], [9.0, 9.0, 9.0]]),
        contact=np.array([[6, 1, 1], [10, 2, 6], [0, 0, 0], [5, 0, 0]]),
        takes=[],
    )
    chosen = Trials(np.zeros(4, np.int64), np.zeros(4), np.array([False, False, False, True]))
    found = summary(outcomes, chosen, np.array(["a", "a", "b", "a"]))
    assert found["trials"] == 3
    assert found["completed"]["rate"] == pytest.approx(2 / 3)
    assert found["completed_whole"]["rate"] == 1.0
    a, b = found["by_clip"]
    assert (a["clip"], a["trials"], a["completed"]["rate"]) == ("a", 2, 0.5)
    assert a["body_cm"] == pytest.approx(100 * (10 * 0.1 + 30 * 0.2) / 40)
    assert a["object_cm"] == pytest.approx(100 * (10 * 0.03 + 30 * 0.11) / 40)
    assert a["contact_f1"] == pytest.approx(2 * 16 / (2 * 16 + 3 + 7))
    assert a["ends"] == {"end_body": 0.0, "end_root": 0.0, "end_box": 0.5, "end_grip": 0.0}
    assert (b["object_cm"], b["contact_f1"], b["steps"]) == (None, None, 20.0)


@pytest.mark.filterwarnings("error")
def test_a_clip_that_no_trial_starts_in_has_no_figures() -> None:
    outcomes = Outcomes(
        completed=np.array([True]),
        ends=np.zeros((1, 4), bool),
        steps=np.array([10]),
        deviation=np.full((1, 3), 0.1),
        contact=np.zeros((1, 3), int),
        takes=[],
    )
    whole = Trials(np.zeros(1, np.int64), np.zeros(1), np.array([True]))
    found = summary(outcomes, whole, np.array(["a"]))
    (a,) = found["by_clip"]
    assert a["trials"] == 0 and (a["body_cm"], a["root_cm"], a["steps"]) == (None, None, None)
    assert "NaN" not in json.dumps(found)


def test_a_player_has_the_reference_beside_each_take() -> None:
    chosen = manifest(bank(), 0, 0)
    takes = run(WORLD, bank(), None, chosen, 1, record=2).takes
    found = takes_of(Recording(takes, {"task": "track"}), "track")
    source = next(iter(found.values()))
    assert source.follows
    assert np.array_equal(source.followed(3), takes[0].ghost[3])
    assert source.poses(3).shape == (source.model.nbody, 7)
