"""Meanings and limits of figures."""

from console.bench.command import table
from console.bench.meanings import NO_LIMIT, meaning, verdict


def test_a_figure_is_compared_with_the_limit_that_is_stated_for_it() -> None:
    figures = {"samples_per_s": 8_000.0, "goal_samples_per_s": 11_500.0, "to_goal_ratio": 0.7,
               "blown_up_scenes": 0.0, "swap_ms": 3.0}  # fmt: skip
    assert verdict("samples_per_s", figures) == "MISSED: at least 1.15e+04"
    assert verdict("to_goal_ratio", figures) == "MISSED: at least 1"
    assert verdict("blown_up_scenes", figures) == "met: at most 0"
    assert verdict("swap_ms", figures) == verdict("goal_samples_per_s", figures) == NO_LIMIT
    assert verdict("samples_per_s", {"samples_per_s": 1.0}) == (
        "none is set here: goal_samples_per_s is not among the figures"
    )
    assert verdict("to_goal_ratio", {"to_goal_ratio": 1.0}) == "met: at least 1"


def test_goals_of_the_policy_service_are_those_of_its_bench() -> None:
    goals = {"goal_to_echo_ratio": 0.6, "goal_streams_256_p99_ms": 10.0}
    figures = goals | {
        "act_64_per_s_to_echo_ratio": 0.5,
        "act_64_per_processor_s_to_echo_ratio": 1.0,
        "act_64_per_s_to_ray_ratio": 9.0,
        "policy_streams_256_p99_ms": 6.0,
    }
    assert verdict("act_64_per_s_to_echo_ratio", figures) == "MISSED: at least 0.6"
    assert verdict("policy_streams_256_p99_ms", figures) == "met: at most 10"
    assert verdict("act_64_per_processor_s_to_echo_ratio", figures) == NO_LIMIT
    assert verdict("act_64_per_s_to_ray_ratio", figures).startswith(NO_LIMIT)  # its goal is absent
    assert meaning("policy_streams_256_p99_ms").startswith("policy service: 99th percentile")


def test_names_are_put_into_words() -> None:
    assert meaning("style_alone_s") == "time of style measured alone: its limit in an iteration"
    assert meaning("actors_64_to_ideal_ratio") == "intake of 64 actors over what they send"
    assert meaning("bvh/exceptions") == "damaged files that ended in an exception bvh/"
    assert meaning("some_new_figure_ms") == "some new figure ms"


def test_the_table_has_all_of_it() -> None:
    shown = table("learner", {"update_s": 0.5, "to_goal_ratio": 2.0})
    cells = [list(column.cells) for column in shown.columns]
    assert cells[0] == ["update_s", "to_goal_ratio"] and cells[1] == ["0.5", "2"]
    assert cells[2][0].startswith("time of one update") and cells[3] == [
        NO_LIMIT,
        "met: at least 1",
    ]


def test_the_least_and_the_greatest_stand_beside_a_figure() -> None:
    name = "skrl_at_200_return"
    shown = table("learning", {name: 3.0, f"{name}_least": 2.0, f"{name}_greatest": 4.0})
    cells = [list(column.cells) for column in shown.columns]
    assert cells[0] == [name] and cells[1] == ["3 (2-4)"]
    assert cells[2][0].startswith("skrl: undiscounted return") and "200 samples" in cells[2][0]


def test_fairness_has_its_limit() -> None:
    figures = {
        "fair_flood_rows_p99_ratio": 2.5,
        "limit_fair_p99_ratio": 3.0,
        "fair_within_limit": 1.0,
    }
    assert verdict("fair_flood_rows_p99_ratio", figures) == "met: at most 3"
    assert verdict("fair_within_limit", figures) == "met: at least 1"
    assert verdict("fair_within_limit", figures | {"fair_within_limit": 0.0}).startswith("MISSED")
    assert "floods with rows: p99" in meaning("fair_flood_rows_p99_ratio")
