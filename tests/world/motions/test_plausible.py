"""What no person does is told from what people do, with the likely cause."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from tests.support import foreign_motions
from tests.support.samp_clips import FOLDER
from world.motions import plausible
from world.motions.clip import Clip
from world.motions.formats import landmarks, registry
from world.motions.formats.recording import Recording
from world.motions.retarget import body
from world.motions.synthetic import library

SHARED = FOLDER.parent
FPS = 30


@pytest.fixture(scope="module")
def walk() -> Clip:
    return library.walking(np.random.default_rng(0), 1.2)


def points(recording: Recording) -> Mapping[str, np.ndarray]:
    """The points of a recording as `judged` takes them."""
    if recording.own_body:
        scaled = body.own(recording, FPS)[0]
    else:
        scaled = body.scaled(recording, landmarks.find(recording), FPS)
    return {role: scaled.position[:, index] for role, index in scaled.joint.items()}


def judged(recording: Recording) -> str:
    return plausible.judged(points(recording), FPS, recording.fps)


def pendulum(
    hz: float, step_m: float, travel: float = 1.0, seconds: float = 6.0
) -> dict[str, np.ndarray]:
    """A walker whose ankles swing as sines: steps of a known length and frequency."""
    t = np.arange(int(seconds * FPS)) / FPS
    swing = 0.5 * step_m * np.sin(np.pi * hz * t + 0.4)
    x = travel * hz * step_m * t
    zero = np.zeros_like(t)

    def at(ahead: np.ndarray, left: float, up: float) -> np.ndarray:
        return np.stack((x + ahead, zero + left, zero + up), axis=1)

    found = {"head": at(zero, 0.0, 1.5)}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        found |= {
            f"{side}_hip": at(zero, 0.1 * sign, 0.85),
            f"{side}_knee": at(0.5 * sign * swing + 0.02, 0.1 * sign, 0.46),
            f"{side}_ankle": at(sign * swing, 0.1 * sign, 0.05),
            f"{side}_shoulder": at(zero, 0.18 * sign, 1.3),
            f"{side}_elbow": at(zero, 0.2 * sign, 1.03),
            f"{side}_wrist": at(zero + 0.05, 0.2 * sign, 0.78),
        }
    return found


@pytest.mark.parametrize(("hz", "step_m"), [(1.8, 0.6), (1.1, 0.45), (2.3, 0.8), (0.5, 0.6)])
def test_a_walk_of_known_steps_is_measured(hz: float, step_m: float) -> None:
    walk = plausible.longest_walk(pendulum(hz, step_m, seconds=10), FPS)
    assert walk is not None
    assert walk.hz == pytest.approx(hz, rel=0.02)
    assert walk.step_m == pytest.approx(step_m, rel=0.03)
    assert walk.speed_m_s == pytest.approx(hz * step_m, rel=0.02)
    assert walk.travel_factor == pytest.approx(1.0, rel=0.05)
    assert walk.rate_factor == pytest.approx(plausible.WALK_RATIO_MS * hz / step_m, rel=0.05)


@pytest.mark.parametrize(("hz", "step_m"), [(1.2, 0.4), (1.8, 0.6), (2.3, 0.75), (1.35, 0.83)])
def test_walks_of_people_are_plausible(hz: float, step_m: float) -> None:
    assert plausible.judged(pendulum(hz, step_m), FPS, FPS) == ""


@pytest.mark.parametrize(
    ("factor", "stated", "true"),
    [(4.0, 120, 30), (8.0, 240, 30), (4.0, 480, 120), (0.25, 30, 120), (0.25, 120, 480)],
)
def test_a_wrong_rate_is_told_from_the_steps(factor: float, stated: int, true: int) -> None:
    found = plausible.judged(pendulum(1.8 * factor, 0.6, seconds=10), FPS, stated)
    assert found.endswith(f"is it at {true} fps? (--fps {true})")
    found = plausible.judged(pendulum(1.8 * factor, 0.6, seconds=10), FPS, stated, stated=True)
    assert found.endswith(f"at the {stated} fps that the file states (--fps {true} overrides)")
    assert "is it at" not in found


@pytest.mark.parametrize(
    ("travel", "said"),
    [
        (100.0, "is its travel in cm? (--unit cm)"), (1000.0, "is its travel in mm? (--unit mm)"),
        (39.37, "is its travel in in? (--unit in)"), (0.01, "it walks on the spot"),
        (0.0, "it walks on the spot"),
    ],
)  # fmt: skip
def test_a_travel_that_does_not_fit_the_steps(travel: float, said: str) -> None:
    assert said in plausible.judged(pendulum(1.8, 0.6, travel), FPS, FPS)


def test_a_short_walk_without_any_travel_is_on_the_spot() -> None:
    """Four steps suffice where the hips stay; a person who turns or sways moves them."""
    still = plausible.judged(pendulum(1.8, 0.6, 0.01, seconds=3.0), FPS, FPS)
    assert "it walks on the spot" in still
    assert plausible.judged(pendulum(1.8, 0.6, 0.15, seconds=3.0), FPS, FPS) == ""


def test_joints_of_another_part_are_told_by_their_lengths() -> None:
    right = pendulum(1.8, 0.6)
    for role, of, said in (
        ("left_knee", "left_hip", "left thigh"),
        ("left_wrist", "right_wrist", "left lower arm"),
        ("left_ankle", "left_knee", "left shin"),
        ("right_elbow", "right_shoulder", "right upper arm"),
    ):
        wrong = right | {role: right[of]}
        assert said in plausible.judged(wrong, FPS, FPS)
    longer = right | {"left_wrist": right["left_elbow"] * (1, 1, 0.4)}
    assert "are these its joints? (--map)" in plausible.judged(longer, FPS, FPS)


def test_exchanged_sides_bend_their_knees_the_wrong_way(walk: Clip) -> None:
    right = points(foreign_motions.recorded(walk))
    swapped = {
        role.replace("left", "x").replace("right", "left").replace("x", "right"): at
        for role, at in right.items()
    }
    assert plausible.judged(right, FPS, FPS) == ""
    assert "are right and left exchanged? (--map)" in plausible.judged(swapped, FPS, FPS)


def test_a_walker_who_lies_has_another_axis() -> None:
    turned = {role: at[:, [0, 2, 1]] * (1, -1, 1) for role, at in pendulum(1.8, 0.6).items()}
    assert "is another axis upward? (--up y or --up z)" in plausible.judged(turned, FPS, FPS)


def test_speeds_and_heights_that_no_person_reaches() -> None:
    standing = pendulum(0.0, 0.0)
    t = np.arange(len(standing["head"]))[:, None] / FPS
    fast = {role: at + 12.0 * t * (1, 0, 0) for role, at in standing.items()}
    assert "the pelvis moves at 12.0 m/s" in plausible.judged(fast, FPS, FPS)
    high = {role: at + np.array([0, 0, 3.0]) for role, at in standing.items()}
    assert "the pelvis is 3.9 m above the floor" in plausible.judged(high, FPS, FPS)
    # 15 cm up and down three times a second falls at 53 m/s²
    bounce = {role: at + 0.15 * np.sin(6 * np.pi * t) * (0, 0, 1) for role, at in standing.items()}
    assert "falls faster than freely" in plausible.judged(bounce, FPS, FPS)


def test_clips_with_and_without_a_recorded_skeleton(walk: Clip) -> None:
    assert plausible.implausible(walk) == ""
    assert "is it at 30 fps" in plausible.implausible(replace(walk, fps=120), 120)


@pytest.mark.skipif(not (SHARED / "cmu").is_dir(), reason="no ../shared/motions")
@pytest.mark.parametrize(
    "name",
    ["cmu/08_11.bvh", "cmu/27_01.bvh", "cmu/01_08.amc", "accad/Male1_C21_RunToPickupBox.bvh",
     "accad/Male1_B22_SideStepLeft.bvh", "accad/Male1_A9_LieDown.bvh", "accad/Male1_A7_Crouch.bvh",
     "deepmimic/humanoid3d_walk.txt"],
)  # fmt: skip
def test_people_are_plausible_at_their_rate_and_walkers_not_at_four_times_it(name: str) -> None:
    recording = registry.read(SHARED / name)
    assert judged(recording) == ""
    if name.startswith("cmu/0") and "01_08" not in name:
        assert "--fps" in judged(replace(recording, fps=4 * recording.fps))
