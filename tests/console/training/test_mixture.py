"""`inhabit train --mix` and what follows it: one policy of two tasks, on two clips of a few
seconds."""

import json
from pathlib import Path

import pytest
import torch

from console.app import main
from console.run import assembly
from policy.checkpoints.format import read_manifest
from policy.model.acting import Policy
from tests.support.track_scenes import clips
from world import tasks
from world.character.features import STATE
from world.motions import clip_file

WORDS = """--mix sit=0.5 track=0.5 --world.track.goal sit --scenes 64 --block 32 --horizon 8
    --ppo.hidden 32 16 --ppo.warmup-iterations 1 --world.track.boxes 1 --world.pieces 4
    --world.scales 1 --style.hidden 32 16 --style.replay 4096 --clone-samples 500
    --world.penalty.skating 0.2"""
SMALL = """--iterations 1 --scenes 64 --block 32 --horizon 8 --ppo.hidden 32 16 --world.pieces 4
    --world.scales 1 --style.hidden 32 16 --style.replay 4096"""


@pytest.fixture(scope="module")
def motions(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("clips")
    for clip in clips()[::2]:
        clip_file.write(folder / f"{clip.name}.npz", clip)
    return str(folder)


def train(motions: str, run: Path, *words: str) -> list[dict[str, float]]:
    begin = ["train", "sit", "--run", str(run), "--motions", motions, *WORDS.split()]
    assert main([*begin, *words]) == 0
    return [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]


def same(line: dict[str, float]) -> dict[str, float]:
    free = {"seconds", "actors/alive"}
    return {k: v for k, v in line.items() if k not in free and not k.startswith("rate/")}


@pytest.fixture(scope="module")
def run(motions: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("mixture") / "one"
    lines = train(motions, path, "--iterations", "4", "--actors", "1", "--clone-passes", "1")
    last = lines[-1]
    # each task's scenes have its own terms, starts and ends; one discriminator, of sit's scenes
    assert 0.4 < last["reward/track_body"] < 1.0
    assert "reward/sit_approach" in last
    assert -1.0 < last["reward/sit_skating"] < 0.0
    assert -1.0 < last["reward/track_skating"] < 0.0
    assert "reward/sit_jerk" not in last, "it has no weight"
    assert 0.0 < last["reward/style"] < 5.0
    assert last["episode/length_track_reference"] > 0.0
    assert "episode/success_sit_near" in last
    return path


def test_the_numbers_are_the_same_over_two_actors_and_after_a_stop(
    run: Path, motions: str, tmp_path: Path
) -> None:
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    other = tmp_path / "two"
    train(motions, other, "--iterations", "2", "--actors", "2", "--clone-passes", "1")
    again = train(
        motions, other, "--iterations", "4", "--actors", "1", "--clone-passes", "1", "--resume"
    )
    assert [same(line) for line in lines] == [same(line) for line in again]


def test_a_policy_of_one_task_comes_out_of_it(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "figures.json"
    words = ["--trials", "8", "--quality", "0", "--json", str(out)]
    assert main(["evaluate", str(run), *words]) == 0
    assert json.loads(out.read_text())["task"] == "sit"
    assert main(["publish", str(run), str(tmp_path / "sit")]) == 0
    manifest = read_manifest(tmp_path / "sit")
    assert manifest.layout.task == "sit"
    assert dict(manifest.layout.goal) == {f.name: f.width for f in tasks.make("sit").goal}
    published, whole = (assembly.trained(path) for path in (tmp_path / "sit", run))
    state, goal = torch.randn(5, STATE.width), torch.randn(5, tasks.make("sit").goal.width)
    torch.testing.assert_close(
        Policy(published.weights)(state, goal), Policy(whole.weights)(state, goal)
    )
    # the mixture's policy never saw the reference
    capsys.readouterr()
    for task, words in (("track", "never sees the goal of track: choose sit"), ("lie", "sit")):
        assert main(["evaluate", str(run), "--task", task]) == 2
        assert words in capsys.readouterr().err
    assert main(["evaluate", str(tmp_path / "sit"), "--task", "lie"]) == 2
    assert "of the task sit" in capsys.readouterr().err


def test_networks_go_from_a_task_to_a_mixture_and_back(
    run: Path, motions: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = SMALL.split()
    alone = ["train", "sit", "--run", str(tmp_path / "alone"), "--motions", motions, *small]
    assert main([*alone, "--init", str(run)]) == 0
    train(motions, tmp_path / "back", "--iterations", "1", "--init", str(tmp_path / "alone"))
    walk = ["train", "walk", "--run", str(tmp_path / "walk"), "--motions", motions, *small]
    assert main([*walk, "--init", str(run)]) == 0
    assert "of the task sit" in capsys.readouterr().out


def test_a_tracker_teaches_scenes_that_hide_its_reference(
    motions: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tracker = tmp_path / "tracker"
    begin = ["train", "track", "--run", str(tracker), "--motions", motions, *SMALL.split()[:10]]
    assert main([*begin, "--world.track.boxes", "1"]) == 0
    taught = ["--world.track.teacher", str(tracker), "--ppo.imitation-weight", "3"]
    free = ["--ppo.kl-target", "0", "100", "--iterations", "12", "--ppo.actor-rate", "0.001"]
    lines = train(motions, tmp_path / "student", *taught, *free)
    errors = [line["ppo/imitation"] for line in lines[2:]]  # the first trains the critic alone
    assert errors[-1] < 0.8 * errors[0]
    # once the labels count nothing, nobody is asked for them
    fades = ["--ppo.imitation-samples", str(int(lines[1]["samples"])), "--iterations", "4"]
    told = ["ppo/imitation" in line for line in train(motions, tmp_path / "fades", *taught, *fades)]
    assert told == [True, True, False, False]
    # who resumes by the same words has the tracker of the beginning, though that has learned on
    before = (tracker / "checkpoints" / "latest").resolve()
    assert main([*begin, "--world.track.boxes", "1", "--resume", "--iterations", "9"]) == 0
    assert (tracker / "checkpoints" / "latest").resolve() != before
    again = [*taught, "--ppo.imitation-samples", fades[1], "--iterations", "5", "--resume"]
    assert len(train(motions, tmp_path / "fades", *again)) == 5
    config = json.loads((tmp_path / "fades" / "config.json").read_text())
    assert config["experiment"]["world"]["track"]["teacher"] == str(before)
    notes = read_manifest(tmp_path / "student" / "checkpoints" / "latest").notes
    assert len(json.loads(notes["lineage"])) >= 1
    capsys.readouterr()
    for words, said in (
        (["--world.track.teacher", str(tracker)], "add --world.track.goal TASK"),
        ([*WORDS.split(), *taught[:2]], "raise it, for instance to 0.1"),
        ([*WORDS.split(), "--world.track.teacher", "walk", *taught[2:]], "policy of the task walk"),
        ([*WORDS.split(), "--world.track.teacher", "nobody", *taught[2:]], "nobody does not exist"),
        ([*WORDS.split(), *taught, "--world.action-scale", "0.2"], "--world.action-scale 0.35"),
    ):
        assert main(["train", "sit", "--dry-run", "--motions", motions, *words]) != 0, words
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1, error


def test_what_cannot_be_mixed_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    for words, said in (
        ("--mix sit=0.5", "two tasks or more"),
        ("--mix track=0.5 lie=0.5", "add sit=SHARE"),
        ("--mix sit=0.5 swim=0.5", "swim"),
        ("--world.track.goal sit", "add --mix track=0.5 sit=0.5"),
    ):
        assert main(["train", "sit", "--dry-run", *words.split()]) == 2, words
        error = capsys.readouterr().err
        assert said in error and error.count("\n") == 1
    assert main(["train", "sit", "--dry-run", "--mix", "sit=1", "track=3"]) == 0
    shown = capsys.readouterr().out
    assert "16 of 64 scenes: sit; 48 of 64 scenes: track" in shown
    assert "reward of track" in shown and "task_track" in shown


def test_clips_that_the_policy_does_not_see_are_not_cloned(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["train", "track", "--dry-run", "--mix", "sit=0.5", "track=0.5"]
    words += ["--world.track.goal", "sit"]
    cloning = [*words, "--clone-passes", "8"]
    assert main(cloning) == 2
    assert "--clone-passes 8: with --world.track.goal the policy" in capsys.readouterr().err
    assert main(words) == main([*cloning, "--init", "track"]) == 0
