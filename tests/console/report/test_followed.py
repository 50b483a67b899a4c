"""The report of a policy that follows clips: its order, its words and the reference it shows."""

import base64
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from console.commands import Report
from console.evaluation import tracking
from console.recording.format import Take
from console.report import followed
from tests.support.console.recordings import take
from tests.support.track_scenes import WORLD, bank
from world.character import model as character
from world.errors import ConfigError


def trial(steps: int, completed: bool, body_cm: float, ends: tuple[str, ...] = ()) -> Take:
    found = take(steps)
    found.meta.update(clip="a", completed=completed, body_cm=body_cm, ends=list(ends))
    return found


def test_trials_are_ranked_by_completion_then_deviation_then_length() -> None:
    takes = [
        trial(30, False, 1.0, ("end_body",)),
        trial(10, True, 5.0),
        trial(20, True, 3.0),
        trial(40, False, 9.0, ("end_root", "end_box")),
    ]
    assert followed.order(takes) == [2, 1, 3, 0]
    assert followed.typical(takes) == {"best": 2, "median": 3, "worst": 0}
    assert followed.described(takes[2]) == "a: follows it to its end for 0.7 s, bodies 3.0 cm off"
    assert followed.described(takes[3]) == "a: ends after 1.3 s by root, box, bodies 9.0 cm off"


def test_the_reference_stands_beside_the_character_where_it_was() -> None:
    chosen = tracking.manifest(bank(), 4, 0)
    (found, *_) = tracking.run(WORLD, bank(), None, chosen, 1, record=2).takes
    found.meta.update(clip="a", completed=False, body_cm=1.0, ends=["end_body"])
    data = followed.replay(found, 2)
    assert (data["hz"], data["goal"]) == (15.0, "reference")
    assert data["frames"] == -(-len(found) // 2) == len(data["error"])
    raw = np.frombuffer(base64.b64decode(data["poses"]), "<i2")
    poses = raw.reshape(data["frames"], data["bodies"], 7)
    ghosts = {shape["body"] for shape in data["shapes"] if shape.get("ghost")}
    assert ghosts == set(range(data["bodies"] - 15, data["bodies"]))
    # MuJoCo's own kinematics of the character alone
    model = character.spec().compile()
    state = mujoco.MjData(model)
    row = data["frames"] - 1
    state.qpos[:] = found.ghost[2 * row]
    mujoco.mj_kinematics(model, state)
    expected = [state.xpos[model.body(name).id] for name in character.BODIES]
    shown = poses[row, data["bodies"] - 15 :]
    np.testing.assert_allclose(shown[:, :3] / 1000.0, expected, atol=6e-4)
    apart = np.hypot(*(found.qpos[2 * row, :2] - found.ghost[2 * row, :2]))
    assert data["error"][row] == pytest.approx(apart, abs=6e-4)


def test_the_table_has_a_dash_for_a_clip_without_trials() -> None:
    part: dict[str, Any] = {
        "trials": 0,
        "completed": {"rate": 0.0, "ci95": [0.0, 1.0]},
        "completed_whole": {"rate": 0.5, "ci95": [0.1, 0.9]},
        "body_cm": None,
        "root_cm": None,
        "object_cm": None,
        "contact_f1": None,
        "ends": {"end_body": 0.0},
    }
    some = part | {
        "trials": 4,
        "completed": {"rate": 0.75, "ci95": [0.3, 0.95]},
        "ends": {"end_body": 0.25, "end_root": 0.0},
        "body_cm": 6.25,
    }
    text = followed.by_clip(some | {"by_clip": [part | {"clip": "b"}]})
    assert "<td>all</td><td>4</td><td>75.0 % (30.0-95.0)</td><td>50</td><td>6.2</td>" in text
    assert "<td>body 25 %</td>" in text
    assert "<td>b</td><td>0</td><td>-</td><td>50</td><td>-</td>" in text


def test_options_without_a_meaning_are_refused() -> None:
    none: Any = None
    for options in ({"perturb": "moved"}, {"objects": "train"}):
        command = Report(Path("x"), **options)  # pyright: ignore[reportArgumentType]
        with pytest.raises(ConfigError, match="leave them out"):
            followed.text(command, none, (), {})
