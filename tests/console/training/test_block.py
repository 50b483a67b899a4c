"""The block of a training: nothing cropped and no figure broken, on screens of any width."""

import io

import pytest
from rich.console import Console

from console.run.stages import Stage
from console.training.block import (
    Block,
    Row,
    bar,
    count,
    discriminator,
    figure,
    fitting,
    plain_line,
)
from console.training.goal import Goal
from tests.support.console.recipes import FIVE

#: What a short training of sit with the recipe `paper` wrote after 40 iterations.
METRICS = {
    "iteration": 40, "samples": 10240, "seconds": 8.6, "style/accuracy_policy": 1.0,
    "style/accuracy_mocap": 1.0, "style/logit_gap": 4.63, "style/skipped": 0.0,
    "style/loss": 0.175, "style/penalty": 0.094, "reward/style": 0.073, "reward/task": 0.303,
    "reward/approach": 0.453, "reward/facing": 0.727, "reward/overspeed": -0.0002,
    "reward/sit": 0.043, "ppo/kl": 0.1419, "ppo/clip_fraction": 0.293,
    "ppo/value_explained": 0.94, "episode/return": 36.64, "episode/length": 201.0,
    "episode/success": 0.051, "episode/fall": 0.678, "episode/stage_approached": 0.508,
    "episode/stage_touched": 0.305, "episode/success_reference": 0.12,
    "episode/fall_reference": 0.72, "episode/success_near": 0.0, "episode/fall_near": 0.714,
    "episode/success_far": 0.0, "episode/fall_far": 0.6, "recipe/stage": 2.0,
    "recipe/samples": 10240.0, "recipe/unmet": 1.0, "rate/samples_per_s": 866.0,
    "rate/world_s": 0.140, "rate/policy_s": 0.035, "rate/style_s": 0.108, "rate/update_s": 0.065,
    "rate/iteration_s": 0.296, "lag/policy": 0.0, "lag/style": 0.0, "actors/alive": 2.0,
    "dropped/samples": 0.0,
}  # fmt: skip
GOAL = Goal(iterations=60)


@pytest.fixture(scope="module")
def stages() -> tuple[Stage, ...]:
    return FIVE


def shown(width: int, height: int, stages: tuple[Stage, ...] = (), goal: Goal = GOAL) -> list[str]:
    file = io.StringIO()
    console = Console(file=file, width=width, height=height, force_terminal=True, color_system=None)
    console.print(Block("sit runs/first", goal, METRICS, "0:04", stages))
    return file.getvalue().splitlines()


@pytest.mark.parametrize("width", [40, 57, 60, 80, 132])
def test_no_figure_is_broken_or_cropped(width: int, stages: tuple[Stage, ...]) -> None:
    lines = shown(width, 60, stages)
    assert max(map(len, lines)) <= width
    for row in Block("sit", GOAL, METRICS, "0:04", stages).rows():
        assert any(line.startswith(row.label) for line in lines)
        for item in row.items:
            assert any(item in line for line in lines), item


def test_what_it_says(stages: tuple[Stage, ...]) -> None:
    lines = [" ".join(line.split()) for line in shown(80, 60, stages)]
    assert lines[0] == "sit runs/first" and lines[1] == f"[{'#' * 52}{'.' * 26}]"
    for words in (
        "progress 67% done to go 0:04 866 samples/s 10,240 samples iteration 40",
        "stage 2 of 5 approach 10,240 of at most 20.00 M samples",
        "1 before it not met",
        "success all 5.1% reference 12.0% near 0.0% (wanted 40%)",
        "far 0.0% (wanted 40%)",
        "fall all 67.8% reference 72.0% near 71.4% far 60.0%",
        "reached approached 50.8% touched 30.5%",
        "discriminator right on mocap 100.0% right on policy 100.0% logit gap 4.63",
        "reward style 0.073 task 0.303 approach 0.453 facing 0.727",
    ):
        assert words in lines


def test_a_low_screen_leaves_out_what_matters_least(stages: tuple[Stage, ...]) -> None:
    for width, height in ((80, 24), (40, 24), (40, 12), (80, 8)):
        lines = shown(width, height, stages)
        assert len(lines) < height, (width, height)
        text = "\n".join(lines)
        assert "866 samples/s" in text and "to go 0:04" in text
    assert "success" in "\n".join(shown(40, 12, stages))
    rows = [Row("a", ["1"], 0), Row("b", ["2"], 2), Row("c", ["3"], 1)]
    assert [row.label for row in fitting(rows, 80, 2)] == ["a", "c"]
    assert fitting(rows, 80, 3) == rows and len(fitting(rows, 80, 0)) == 1


def test_without_limits_and_recipe_there_is_neither_bar_nor_stage() -> None:
    text = "\n".join(shown(80, 60, goal=Goal()))
    assert "#" not in text and "stage" not in text and "wanted" not in text
    assert "until Ctrl-C" in text and "to go" not in text


def test_before_the_first_episode_ends_a_dash_stands_for_its_figures() -> None:
    line = plain_line(GOAL, {"iteration": 1, "samples": 512}, "-")
    assert "iteration 1  512 samples  - samples/s  to go -  success all -  fall -" in line


def test_the_plain_line_holds_success_by_start_and_stage(stages: tuple[Stage, ...]) -> None:
    line = plain_line(GOAL, METRICS, "0:04", stages)
    assert "stage 2 of 5  success all 5.1% reference 12.0% near 0.0% (wanted 40%) far" in line
    assert "discriminator right on mocap 100.0%, right on policy 100.0%, logit gap 4.63" in line
    assert "\n" not in line


def test_the_throttle_is_told() -> None:
    assert discriminator({})[3] == "not throttled"
    assert discriminator({"style/skipped": 0.25})[3] == "throttled: 25% skipped"


def test_numbers() -> None:
    assert (count(15360), count(1.924e6)) == ("15,360", "1.92 M")
    found = {"a": -0.0002, "b": float("nan"), "c": -1.5}
    texts = [figure(found, name, ".3f") for name in ("a", "b", "c", "d")]
    assert texts == ["0.000", "-", "-1.500", "-"]
    assert bar(0.0, 6) == "[....]" and bar(0.5, 6) == "[##..]" and bar(1.0, 6) == "[####]"
