"""Recipes of two and three stages of ten iterations of 64 samples."""

from pathlib import Path

TINY = """
preset = "fast"
[settings]
"world.episode-s" = 0.5
[[stage]]
name = "first"
settings = { "ppo.sigma" = [[0, 0.05], [512, 0.04]], "world.initial.near" = 0.6 }
ends = { success = { all = 0.0 }, episodes = 16, at-least = 640, limit = 100000 }
[[stage]]
name = "second"
about = "Cannot be met."
settings = { "ppo.sigma" = [[0, 0.03]], "ppo.mirror-weight" = 0.01 }
ends = { success = { near = 1.0 }, episodes = 16, limit = 640 }
[[stage]]
name = "third"
[stage.settings]
"style.steps-per-iteration" = 3
"world.perturb.projectiles-per-s" = 2
"world.perturb.moved-fraction" = 0.5
"world.perturb.pushes-per-s" = 1
[stage.ends]
success = { all = 0.0 }
episodes = 16
at-least = 640
limit = 100000
"""


def tiny(folder: Path, iterations: int = 10) -> Path:
    """The file of the recipe in `folder`, with so many iterations a stage."""
    path = folder / "tiny.toml"
    path.write_text(TINY.replace(" 640", f" {64 * iterations}"))
    return path


#: Walk before the task of the run.
OF_TWO_TASKS = """
[settings]
"world.episode-s" = 0.5
[[stage]]
name = "way"
task = "walk"
settings = { "world.initial.far-m" = [0.5, 9.0] }
ends = { success = { all = 0.0 }, episodes = 16, at-least = 640, limit = 100000 }
[[stage]]
name = "seat"
ends = { success = { all = 0.0 }, episodes = 16, at-least = 640, limit = 100000 }
"""
