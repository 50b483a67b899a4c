"""The example that tries the porter in the trials of policies."""

from examples.try_porter import Settings, attempt


def test_the_porter_comes_to_boxes_near_by() -> None:
    figures = attempt(Settings(trials=4, near_m=1.0, far_m=1.5, seconds=9.0))
    stages = {part["stage"]: part["rate"] for part in figures["by_stage"]}
    assert stages["approached"] == 1.0
    assert stages["grasped"] > 0.0
    assert len(figures["by_distance"]) and figures["success"]["rate"] <= stages["placed"]


def test_one_who_errs_much_falls() -> None:
    wild = Settings(trials=4, near_m=3.0, far_m=4.0, seconds=4.0, noise=0.3)
    assert attempt(wild)["falls"] == 1.0


def test_who_errs_a_little_comes_to_the_box() -> None:
    """Pupils err by more: a gait that does not bear this is no teacher's (docs/recipe.md)."""
    figures = attempt(Settings(trials=16, near_m=2.0, far_m=3.0, seconds=7.0, noise=0.03))
    stages = {part["stage"]: part["rate"] for part in figures["by_stage"]}
    assert stages["approached"] > 0.7
