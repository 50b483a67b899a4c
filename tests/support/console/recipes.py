"""Recipes of two and three stages of ten iterations of 64 samples, and one with runs before its
own."""

from pathlib import Path

from console.run.stages import Stage

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


#: A walker, a tracker and what is distilled from both, each as small as can be.
WITH_RUNS_BEFORE = """
preset = "finetune"
[settings]
"world.episode-s" = 0.5
"ppo.warmup-iterations" = 1
[[before]]
name = "way"
command = "train walk --iterations 4 SMALL --clone-passes 0"
[[before]]
name = "clips"
command = "train track --iterations FOLLOWED SMALL --world.track.boxes 1"
[[before]]
name = "both"
command = "distill sit --init {way} --world.walker {way} --world.tracker {clips} TAUGHT"
[[stage]]
name = "seat"
ends = { success = { all = 0.0 }, episodes = 16, at-least = 640, limit = 100000 }
"""
_SMALL = (
    "--scenes 16 --block 8 --horizon 4 --world.episode-s 0.5 --checkpoint-every 2"
    " --style.hidden 16 --style.batch 32 --style.penalty-batch 16 --style.normaliser-samples 500"
)
_TAUGHT = "--batches 20 --first 200 --steps 10 --scenes 8 --world.pieces 2 --world.classes chair"


def with_runs_before(folder: Path, followed: int) -> Path:
    """The file of that recipe in `folder`; followed: iterations of the tracker."""
    path = folder / "before.toml"
    text = WITH_RUNS_BEFORE.replace("FOLLOWED", str(followed))
    path.write_text(text.replace("SMALL", _SMALL).replace("TAUGHT", _TAUGHT))
    return path


_RATES = (0.15, 0.4, 0.65, 0.8, 0.75)
#: Five stages as they are displayed; the second has conditions on near and far.
FIVE = tuple(
    Stage(name, success={"near": rate, "far": rate}, limit=20_000_000)
    for name, rate in zip(("sit down", "approach", "all", "quiet", "last"), _RATES, strict=True)
)
