"""A tiny recipe under real training: its stages, what it says, and exact resumption."""

import json
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from console.app import main
from console.run.metrics import read_metrics
from console.serving.loading import served
from policy.checkpoints.format import Manifest, read_manifest
from tests.support.console.recipes import OF_TWO_TASKS, tiny
from tests.support.console.runs import said
from tests.support.kill_learner import flags, numbers
from tests.support.small_clips import write
from world.character.features import STATE


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The words of a training by the recipe, without its run."""
    folder = tmp_path_factory.mktemp("recipe")
    return ["train", "sit", "--recipe", str(tiny(folder)), *flags(write(folder / "clips"))]


@pytest.fixture(scope="module")
def whole(made: list[str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of the recipe to its end."""
    run = tmp_path_factory.mktemp("run") / "whole"
    assert main([*made, "--run", str(run)]) == 0
    return run


def manifest_of(run: Path) -> Manifest:
    return read_manifest(run / "checkpoints" / "latest")


def tensors(run: Path) -> dict[str, torch.Tensor]:
    files = sorted((run / "checkpoints" / "latest").glob("*.safetensors"))
    return {f"{file.stem}/{k}": v for file in files for k, v in load_file(file).items()}


def test_stages_follow_one_another_by_what_is_measured(whole: Path) -> None:
    lines = read_metrics(whole / "metrics.jsonl")
    assert [int(line["recipe/stage"]) for line in lines] == [1] * 10 + [2] * 10 + [3] * 10
    assert [int(line["recipe/samples"]) for line in lines] == list(range(64, 641, 64)) * 3
    assert [int(line["recipe/unmet"]) for line in lines] == [0] * 20 + [1] * 10
    # samples of a schedule count from the beginning of the stage
    assert lines[9]["ppo/sigma"] == pytest.approx(0.04) and lines[10]["ppo/sigma"] == 0.03
    assert lines[0]["ppo/sigma"] == 0.05
    assert "ppo/mirror" not in lines[9] and "ppo/mirror" in lines[10]
    config = json.loads((whole / "config.json").read_text())
    assert config["recipe"].endswith("tiny.toml")
    assert [stage["name"] for stage in config["experiment"]["stages"]] == [
        "first", "second", "third",
    ]  # fmt: skip
    manifest = json.loads((whole / "checkpoints/latest/manifest.json").read_text())
    assert manifest["notes"]["stage"] == "3"
    of_stage = json.loads(manifest["notes"]["experiment"])["world"]["perturb"]
    assert of_stage["moved_fraction"] == 0.5, "the checkpoint tells the settings that made it"


def test_a_policy_is_served_with_the_noise_of_its_stage(whole: Path, tmp_path: Path) -> None:
    """A published one too. Schedules count from the beginning of the stage, at 1,280 samples."""
    assert main(["publish", str(whole), str(tmp_path / "published")]) == 0
    for folder in (whole / "checkpoints" / "latest", tmp_path / "published"):
        found = served("sit", folder)
        assert found.manifest.samples == 1920
        assert found.sigma == pytest.approx(0.05 - 0.015 * 640 / 6e6, rel=1e-9)


@pytest.mark.parametrize("stops", [(14,), (10, 20), (3, 26)])
def test_a_run_that_stops_in_a_stage_goes_on_in_it_bit_for_bit(
    stops: tuple[int, ...], made: list[str], whole: Path, tmp_path: Path
) -> None:
    """In the middle of a stage, and right at the end of one."""
    run, more = tmp_path / "run", ["--restart"]
    for iterations in (*stops, 1000):
        words = [*made, "--run", str(run), "--iterations", str(iterations), *more]
        assert main(words) == 0
        more = ["--resume"]
    found, wanted = tensors(run), tensors(whole)
    assert found.keys() == wanted.keys()
    assert not [name for name in wanted if not torch.equal(found[name], wanted[name])]
    lines, expected = (read_metrics(r / "metrics.jsonl") for r in (run, whole))
    assert [numbers(line) for line in lines] == [numbers(line) for line in expected]


def test_the_stages_are_said_and_a_limit_is_said_as_a_failure(
    made: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*made, "--run", str(tmp_path / "run"), "--ppo.mirror-weight", "0"]
    assert main([*words, "--iterations", "21"]) == 0
    text = capsys.readouterr().out
    assert f"--ppo.mirror-weight overrides the recipe {made[3]}: stage 2" in text
    assert "stage 1 of 3, first, begins: until all >= 0.00 of 16 episodes" in text
    assert "stage 1 of 3, first, ended after 0.00064 M samples: all 0." in text
    assert "stage 2 of 3, second, FAILED its condition within 0.00064 M samples: near 0." in text
    assert "stage 3 of 3, third, begins" in text and "the recipe has ended" not in text
    resumed = ["train", "sit", "--run", str(tmp_path / "run"), "--resume", "--iterations", "1000"]
    assert main(resumed) == 0  # needs neither --recipe nor its flags
    assert "the recipe has ended; failed: stage 2" in capsys.readouterr().out
    assert main([*resumed, "--recipe", "paper"]) == 1
    assert f"was started with --recipe {made[3]}" in said(capsys)


def test_dry_run_prints_the_schedule(made: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*made, "--dry-run"]) == 0
    text = capsys.readouterr().out
    for word in ("1 first", "2 second", "Cannot be met.", "ppo.sigma 0 0.05, 512 0.04",
                 "near >= 1.00", "projectiles-per-s 2", "at most 0.20064 M samples"):  # fmt: skip
        assert word in text


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The words of a training that learns to walk before it learns to sit."""
    folder = tmp_path_factory.mktemp("two")
    path = folder / "two.toml"
    path.write_text(OF_TWO_TASKS)
    clips = write(folder / "clips")
    return ["train", "sit", "--recipe", str(path), *flags(clips), "--world.classes", "chair"]


@pytest.mark.parametrize("stops", [(5, 15), (10,), (11,)])
def test_a_stage_of_another_task_hands_on_its_networks_alone(
    stops: tuple[int, ...], two: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, more = tmp_path / "run", ["--restart"]
    found: dict[int, tuple[Manifest, dict[str, torch.Tensor]]] = {}
    for iterations in (10, 11, 1000):
        words = [*two, "--run", str(run), "--iterations", str(iterations), *more]
        assert main(words) == 0
        found[iterations], more = (manifest_of(run), tensors(run)), ["--resume"]
    (walk, before), (sit, after), (last, end) = found.values()
    assert (walk.layout.task, sit.layout.task, last.layout.task) == ("walk", "sit", "sit")
    assert (walk.iteration, sit.iteration, last.iteration) == (10, 11, 20)
    assert (walk.samples, sit.samples, last.samples) == (640, 704, 1280)
    # the critic warms up again, so that the actor is the walker's for one iteration
    hidden = "policy/actor/layers.2.weight"
    assert torch.equal(before[hidden], after[hidden]) and not torch.equal(
        before[hidden], end[hidden]
    )
    first, own = (tables["policy/actor/layers.0.weight"] for tables in (before, after))
    kept = (own[:, 1 : STATE.width].abs().sum(0) > 0).nonzero().flatten() + 1
    assert len(kept) > STATE.width // 2, "features that varied while it walked"
    # the moments of a feature move with the first samples, and its weights by the same factor
    factors = own[:, kept] / first[:, kept]
    assert torch.allclose(factors, factors[:1].expand_as(factors), rtol=1e-4)
    assert "the task walk; the rest begins anew" in capsys.readouterr().out
    lines = read_metrics(run / "metrics.jsonl")
    assert ["reward/stand" in line for line in lines] == [True] * 10 + [False] * 10
    assert ["reward/sit" in line for line in lines] == [False] * 10 + [True] * 10
    assert json.loads((run / "config.json").read_text())["experiment"]["world"]["task"] == "sit"
    # stopped anywhere else it ends with the same bits
    other, more = tmp_path / "other", ["--restart"]
    for iterations in (*stops, 1000):
        assert main([*two, "--run", str(other), "--iterations", str(iterations), *more]) == 0
        more = ["--resume"]
    theirs = tensors(other)
    assert theirs.keys() == end.keys()
    assert not [name for name in end if not torch.equal(theirs[name], end[name])]


def test_a_mixture_has_no_stage_of_one_task(
    two: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word for word in two if word not in ("--world.classes", "chair")]
    run = tmp_path / "run"
    assert main([*words, "--run", str(run), "--mix", "sit=0.5", "walk=0.5"]) == 2
    assert "--mix: stage way of the recipe has the task walk alone" in said(capsys)
    assert not run.exists()


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ('"ppo.gamma" = 1.5', "stage second: --ppo.gamma 1.5: must be 0 to 1"),
        ('"world.walker" = "walk"', "stage second: --world.walker walk teaches nothing at"),
        (
            '"ppo.imitation-weight" = 0.1\n"world.walker" = "sit"',
            "stage second: --world.walker sit is a policy of the task sit",
        ),
        ('"world.teacher" = "carry"', "stage second: there is no setting world.teacher"),
        ('"world.perturb.push-n-s" = [9, 3]\n"world.perturb.pushes-per-s" = 1', "push-n-s 9 3"),
    ],
)
def test_a_stage_that_cannot_be_is_refused_before_the_first_begins(
    wrong: str, named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tiny(tmp_path)
    entry = f'name = "second"\n[stage.settings]\n{wrong}\n[stage.ends]\nlimit = 9\n'
    text = path.read_text().split('name = "second"')[0] + entry + "success = { near = 0.5 }"
    path.write_text(text)
    run = tmp_path / "run"
    assert main(["train", "sit", "--recipe", str(path), "--run", str(run)]) == 2
    assert named in said(capsys) and not run.exists()
