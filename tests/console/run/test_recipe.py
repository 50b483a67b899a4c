"""Recipes: files, refusals, what flags override, the settings of each stage."""

from dataclasses import replace

import pytest

from console.app import parse
from console.run import recipe
from console.run.experiment import PRESETS, check
from tests.support.console.recipes import OF_TWO_TASKS, TINY
from world.errors import ChoiceError, ConfigError
from world.initial.reference import KINDS

TASKS = ("sit", "lie", "carry", "walk")
STAGE = '[[stage]]\nname = "a"\n'
BEFORE = "[[before]]\nname = 'a'\n"
ENDS = "ends = { success = { near = 0.5 }, limit = 100 }\n"


@pytest.mark.parametrize("task", TASKS)
def test_the_packages_recipes_hold_what_they_promise(task: str) -> None:
    found = recipe.find("paper", task)
    experiment, lines = recipe.start(found, ())
    assert not lines and experiment.seed == 0
    experiment = replace(experiment, world=replace(experiment.world, task=task))
    names = [stage.name for stage in experiment.stages]
    steps = [one.name for one in found.before] + names
    assert len(set(steps)) == len(steps) > 3 and names[-1] == "disturbed"
    seeds = set()
    for number, stage in enumerate(experiment.stages, 1):
        staged = check(recipe.staged(experiment, number))
        seeds.add(staged.seed)
        end = recipe.stage_end(experiment, number, KINDS)
        assert end is not None and end.number == number
        assert 0 < end.at_least < end.limit or end.at_least == 0 < end.limit
        assert stage.about, "a researcher reads why"
        for key in {"ppo.sigma", "ppo.kl_target"} & set(stage.settings):
            assert [list(p) for p in getattr(staged.ppo, key[4:])] == stage.settings[key]
        fractions = staged.world.initial
        kinds = {"reference": fractions.reference, "near": fractions.near, "far": fractions.far}
        assert all(kinds[kind] > 0.0 for kind in stage.success), "measured kinds are drawn"
        assert (staged.world.perturb.projectiles_per_s > 0) == (stage.name == "disturbed")
    assert len(seeds) == len(names), "no stage repeats another's draws"
    others = {"carry": ["weights"], "lie": ["free"]}
    assert recipe.names(task) == sorted(["paper", *others.get(task, [])])


def test_a_recipe_that_goes_on_from_a_policy_has_little_noise_and_no_cloning() -> None:
    experiment, _ = recipe.start(recipe.find("free", "lie"), ())
    experiment = replace(experiment, world=replace(experiment.world, task="lie"))
    assert experiment.clone_passes == 0 and experiment.horizon == 32
    stages = [check(recipe.staged(experiment, i)) for i in range(1, len(experiment.stages) + 1)]
    far = [stage.world.initial.far for stage in stages]
    assert far == sorted(far), "from clips to the way"
    last = stages[-1]
    assert last.ppo.sigma[-1][1] < 0.02 and last.world.initial.far_m == (1.0, 10.0)
    end = recipe.stage_end(experiment, len(stages), KINDS)
    assert end is not None and end.at_least >= last.ppo.sigma[-1][0], "the noise has come down"
    disturbed = [stage.world.perturb.projectiles_per_s > 0 for stage in stages]
    assert disturbed == [False] * (len(stages) - 1) + [True]


def test_a_stage_changes_its_settings_alone_and_not_those_of_the_next() -> None:
    found = recipe.parsed(TINY.encode(), "tiny")
    experiment, _ = recipe.start(found, ())
    first, second = recipe.staged(experiment, 1), recipe.staged(experiment, 2)
    assert first.ppo.sigma == ((0.0, 0.05), (512.0, 0.04)) and first.world.initial.near == 0.6
    assert second.ppo.sigma == ((0.0, 0.03),) and second.ppo.mirror_weight == 0.01
    assert second.world.initial == PRESETS["fast"].world.initial
    assert first.world.episode_s == second.world.episode_s == 0.5
    assert recipe.staged(PRESETS["fast"], 1) is PRESETS["fast"]
    assert recipe.stage_end(PRESETS["fast"], 1, KINDS) is None


def test_a_stage_of_another_task_has_its_objects() -> None:
    """Chairs and imported pieces are of the task of the run, not of the way to it."""
    experiment, _ = recipe.start(recipe.parsed(OF_TWO_TASKS.encode(), "two", task="sit"), ())
    world = replace(experiment.world, task="sit", classes=("chair",), objects=("train", "x"))
    experiment = replace(experiment, world=world)
    way, seat = (recipe.staged(experiment, number).world for number in (1, 2))
    assert (way.task, way.classes, way.objects) == ("walk", (), ())
    assert (seat.task, seat.classes, seat.objects) == ("sit", ("chair",), ("train", "x"))
    assert way.initial.far_m == (0.5, 9.0) and seat.initial.far_m == (1.0, 10.0)


def test_a_flag_holds_in_all_stages_and_is_told(tmp_path) -> None:
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    words = ["train", "sit", "--recipe", str(path), "--ppo.sigma", "0", "0.02"]
    command = parse([*words, "--world.episode-s=2", "--ppo.gamma", "0.9", "--world.no-mirror"])
    for number in (1, 2, 3):
        staged = recipe.staged(command.experiment, number)
        assert staged.ppo.sigma == ((0.0, 0.02),) and staged.ppo.gamma == 0.9
        assert staged.world.episode_s == 2.0 and not staged.world.mirror
    assert command.overrides == (
        f"--ppo.sigma overrides the recipe {path}: stage 1, 2",
        f"--world.episode-s overrides the recipe {path}: settings",
    )
    assert parse(["train", "sit"]).overrides == () and not parse(["train", "sit"]).experiment.stages


def test_what_contradicts_a_recipe_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"--preset paper: the recipe paper is of the preset"):
        parse(["train", "sit", "--recipe", "paper", "--preset", "paper"])
    assert parse(["train", "sit", "--recipe", "paper", "--preset", "finetune"]).experiment.stages
    with pytest.raises(ChoiceError, match=r"--recipe.*'papr'.*paper"):
        parse(["train", "sit", "--recipe", "papr"])
    with pytest.raises(ChoiceError, match="--recipe"):
        parse(["train", "track", "--recipe", "paper"])
    with pytest.raises(ConfigError, match=r"none\.toml: no such file"):
        parse(["train", "sit", "--recipe", "none.toml"])
    with pytest.raises(ConfigError, match="--stages is set by --recipe"):
        parse(["train", "sit", "--stages", "3"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("preset = ", "x: not valid TOML"),
        (b"\xff", "x: not valid TOML"),
        ("preset = 'slow'", "x: preset 'slow'; choose fast"),
        ("", "x: has no"),
        ("stage = 3", "x: has no"),
        ("stages = []\n" + STAGE + ENDS, "x: unknown stages"),
        (STAGE, "stage a: needs a name, ends.success and ends.limit"),
        ("[[stage]]\n" + ENDS, "stage ?: needs a name"),
        (STAGE + "ends = { success = { near = 0.5 } }", "ends.success and ends.limit"),
        (STAGE + "ends = { success = { near = 1.5 }, limit = 9 }", "rates are from 0 to 1"),
        (STAGE + "ends = { success = { near = -1 }, limit = 9 }", "numbers from 0"),
        (STAGE + "ends = { success = { near = '1' }, limit = 9 }", "numbers from 0"),
        (STAGE + ENDS + "until = 3", "unknown until"),
        (STAGE + ENDS + "settings = { 'ppo.sigmma' = 1 }", "there is no setting ppo.sigmma"),
        (STAGE + ENDS + "settings = { 'ppo.gamma' = 'x' }", "gamma"),
        (STAGE + ENDS + "settings = { 'ppo.sigma' = [[0]] }", "stage a"),
        (STAGE + ENDS + "settings = { 'ppo.hidden' = [3, 4] }", "is one for all stages"),
        (STAGE + ENDS + "settings = { 'style.window' = 3 }", "is one for all stages"),
        (STAGE + ENDS + "settings = { 'ppo.actor-rate' = 1e-5 }", "is one for all stages"),
        (STAGE + ENDS + "settings = { 'ppo.warmup-iterations' = 5 }", "is one for all stages"),
        (STAGE + ENDS + "settings = { 'scenes' = 64 }", "scenes is one for all stages"),
        (STAGE + ENDS + "settings = { ppo.gamma = 0.9 }", "name settings as flags, in quotes"),
        ("[settings]\n'world' = 3\n" + STAGE + ENDS, "there is no setting world"),
        ("before = 3\n" + STAGE + ENDS, "[[before]] must be a list of tables"),
        ("before = ['walk']\n" + STAGE + ENDS, "[[before]]: must be a table"),
        (BEFORE + "task = 'walk'\n" + STAGE + ENDS, "[[before]]: unknown task"),
        (BEFORE + "command = 3\n" + STAGE + ENDS, "[[before]].command"),
        (BEFORE + STAGE + ENDS, "before a: command: begins with train TASK or distill TASK"),
        (BEFORE + "command = 'train'\n" + STAGE + ENDS, "before a: command: begins with train"),
        (BEFORE + "command = 'serve sit'\n" + STAGE + ENDS, "begins with train TASK"),
        (BEFORE + "command = 'train \"sit'\n" + STAGE + ENDS, "before a: command: No closing"),
        (BEFORE + "command = 'train sit --run x'\n" + STAGE + ENDS, "--run is of the recipe's run"),
        (BEFORE + "command = 'train sit --motions=x'\n" + STAGE + ENDS, "--motions is of the"),
        (BEFORE + "clips = 'mine'\n" + STAGE + ENDS, "must be given, own"),
        (BEFORE + "command = 'train sit --init {b}'\n" + STAGE + ENDS, "no run {b} before it"),
        (BEFORE.replace("'a'", "'A b'") + STAGE + ENDS, "before A b: needs a name of its own"),
        (2 * (BEFORE + "command = 'train sit'\n") + STAGE + ENDS, "before a: needs a name of"),
        (STAGE + ENDS + "task = 'track'", "task 'track'; choose sit, lie, carry, walk"),
        (STAGE + ENDS + "task = ['walk']", "task ['walk']; choose sit, lie, carry, walk"),
        (STAGE + ENDS + "task = 'walk'", "stage a: task walk; the last one is of sit"),
    ],
)  # fmt: skip
def test_an_invalid_file_is_refused_by_one_line_that_names_the_entry(
    text: str | bytes, said: str
) -> None:
    content = text.encode() if isinstance(text, str) else text
    with pytest.raises(ConfigError) as found:
        recipe.parsed(content, "x", task="sit")
    assert said in str(found.value) and str(found.value).startswith("x")


def test_a_recipe_may_extend_another_by_settings() -> None:
    own, paper = recipe.find("weights", "carry"), recipe.find("paper", "carry")
    assert own.name == "weights" and own.stages == paper.stages and own.preset == paper.preset
    experiment, _ = recipe.start(own, ())
    carry = recipe.staged(experiment, 4).world.carry
    assert (carry.scale, carry.weight_kg, carry.sizes) == ((1.0, 1.0), (1.0, 12.0), 48)
    assert experiment.ppo.hidden == (1024, 512), "settings of the extended recipe hold"
    with pytest.raises(ConfigError, match="x: extends 'pap'; choose paper"):
        recipe.parsed(b"extends = 'pap'", "x", task="sit")
    with pytest.raises(ConfigError, match="x: unknown stage"):
        recipe.parsed(("extends = 'paper'\n" + STAGE + ENDS).encode(), "x", task="sit")


def test_a_condition_on_a_category_that_the_task_lacks_is_refused() -> None:
    experiment, _ = recipe.start(recipe.parsed(TINY.encode(), "tiny"), ())
    with pytest.raises(ConfigError, match="stage second: success of near; choose carry_near, all"):
        recipe.stage_end(experiment, 2, ["carry_near"])
