"""`inhabit publish`: a run's policy as a small folder, to evaluate, to initialise from and to cite.

The folder is a checkpoint of the policy alone, which `evaluate`, `video` and `--init` accept like a
run; its manifest states training data and licence.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from console.commands import Publish
from console.evaluation.presets import start_m
from console.run import assembly, mixing
from console.run.directory import RunDirectory, RunError, checkpoint_folder, run_of
from console.run.experiment import to_json
from policy.checkpoints import lineage
from policy.checkpoints.format import Manifest, State, read, write
from policy.checkpoints.lineage import Origin
from policy.checkpoints.numbering import numbered
from policy.checkpoints.run_checkpoints import STAGE_START
from policy.model.averaging import mean_policy
from policy.model.normaliser import NormaliserConfig
from world.errors import ConfigError, InhabitError
from world.partial_files import replacing_folder

#: Number of metrics lines in a published folder, evenly spread over the run.
_LINES = 200
_UNDISTURBED, _METRICS = "evaluation.json", "metrics.jsonl"
#: Files of a published folder.
_PUBLISHED = ("manifest.json", "policy.safetensors", "metrics.jsonl", "evaluation*.json")
_HEADLINE = (
    "task",
    "trials",
    "seed",
    "objects",
    "perturbation",
)
_REACHED = ("success", "sustained", "falls")
_FOLLOWED = ("completed", "body_cm", "object_cm", "contact_f1")


def publish_command(command: Publish) -> int:
    """Write the folder, which may be the source itself; return the exit code."""
    if command.out.exists() and not command.replace:
        raise RunError(f"{command.out} exists: add --replace, or name another folder")
    require_published(command.out)
    path = checkpoint_folder(command.source)
    found = read(path, ("policy",))
    experiment = assembly.experiment_of(found.manifest, path)
    # an unknown task is refused before anything is read or written
    single, _ = mixing.of_one_task(experiment, found.state["policy"], command.task)
    averaged = _last(path, command.average)
    if len(averaged) > 1:
        limits = NormaliserConfig(
            experiment.ppo.observation_clip, experiment.ppo.observation_std_floor
        )
        policies = [read(one, ("policy",)).state["policy"] for one in averaged]
        mixed = mixing.mixture_of(experiment)
        hidden = None if mixed is None else mixing.hidden_columns(mixed)
        found.state["policy"] = mean_policy(policies, limits, hidden)
    single, found.state["policy"] = mixing.of_one_task(
        experiment, found.state["policy"], command.task
    )
    # paths of clips and pieces on this machine are not published: the notes name the data
    world = mixing.untaught(replace(single.world, motions=(), objects=()))
    notes = terms_of(command, found.manifest.notes) | {
        "experiment": json.dumps(to_json(replace(single, world=world))),
    }
    if STAGE_START in found.manifest.notes:
        notes[STAGE_START] = found.manifest.notes[STAGE_START]
    if len(averaged) > 1:
        notes["average"] = f"of checkpoints {', '.join(one.name for one in averaged)}"
    # an average is another policy than the checkpoints that were evaluated
    kept = [] if len(averaged) > 1 else kept_evaluations(path, found.manifest.iteration)
    evaluations = _evaluations(command.evaluation or kept)
    if _UNDISTURBED in evaluations:
        notes["evaluation"] = json.dumps(_headline(evaluations[_UNDISTURBED]))
    # the folder that the command runs in has a name too
    out = path if command.out.resolve() == path else command.out
    texts = {
        name: json.dumps(figures | {"checkpoint": out.name}, indent=1) + "\n"
        for name, figures in evaluations.items()
    }
    if metrics := metrics_of(path):
        texts[_METRICS] = metrics
    if out == path:
        # what is not stated anew stays
        notes = found.manifest.notes | notes
        files = [path / _METRICS, *path.glob("evaluation*.json")]
        texts = {file.name: file.read_text() for file in files if file.exists()} | texts
    manifest = Manifest(
        assembly.layout(single), found.manifest.iteration, found.manifest.samples, notes
    )
    write_folder(out, found.state, manifest, texts)
    print(
        f"{command.out}: {found.manifest.samples / 1e6:.1f} M samples, trained on"
        f" {lineage.data(notes)}; licence: {lineage.licence(notes)}"
    )
    return 0


def metrics_of(checkpoint: Path) -> str:
    """Return lines of the metrics that a checkpoint's run or its published folder keeps, evenly
    spread; empty without any."""
    file = (run_of(checkpoint) or RunDirectory(checkpoint)).metrics
    if not file.exists():
        return ""
    lines = file.read_text().splitlines()
    return "\n".join(lines[:: max(1, len(lines) // _LINES)]) + "\n"


def write_folder(
    out: Path, state: Mapping[str, State], manifest: Manifest, texts: Mapping[str, str]
) -> None:
    """Write a checkpoint with texts beside it by file name, whole or not at all."""
    out.parent.mkdir(parents=True, exist_ok=True)
    with replacing_folder(out) as partial:
        write(partial, state, manifest)
        for name, text in texts.items():
            (partial / name).write_text(text)
        for file in partial.iterdir():
            file.chmod(0o644)  # files are written readable for their owner alone


def require_published(folder: Path) -> None:
    """Raise RunError where a folder holds what no published policy does: it is not replaced."""
    others = sorted(
        file.name
        for file in (folder.iterdir() if folder.exists() else ())
        if not any(file.match(pattern) for pattern in _PUBLISHED) or file.is_dir()
    )
    if others:
        raise RunError(
            f"{folder} holds {others[0]}, which is no part of a published policy and would be lost:"
            " name another folder"
        )


def terms_of(command: Publish, notes: Mapping[str, str]) -> dict[str, str]:
    """Return data, licence and lineage of the published weights, from those of the checkpoint.

    Raises ConfigError for a --licence that drops terms of the training data, without --relicense.
    """
    origins = lineage.of(notes)
    own = lineage.terms(origins)
    licence = command.licence.strip() or notes.get("licence") or own
    # the weights may have stricter terms than their data, which a second publication keeps
    stated = (Origin("the weights", notes["licence"]),) if notes.get("licence") else ()
    # what was stated before was decided then; only other terms are compared
    lost = lineage.lost(licence, (*origins, *stated)) if command.licence.strip() else {}
    if lost and not command.relicense:
        what = "; ".join(
            f"{one.what}: {one.licence} ({', '.join(sorted(names))})" for one, names in lost.items()
        )
        raise ConfigError(
            f"--licence {command.licence}: restricts less than the terms of the training data,"
            f" {what}: leave --licence out, or add --relicense if you may"
        )
    data = command.data.strip() or notes.get("data", "")
    return {"licence": licence, lineage.NOTE: lineage.note(origins)} | (
        {"data": data} if data else {}
    )


def _last(path: Path, count: int) -> list[Path]:
    """Return a checkpoint and those before it in its run, `count` in all, oldest first."""
    if count < 1:
        raise ConfigError(f"--average {count}: publish at least one checkpoint")
    if count == 1:
        return [path]
    run = run_of(path)
    before = [] if run is None else numbered(run.checkpoints)
    kept = before[: before.index(path) + 1] if path in before else []
    if len(kept) < count:
        raise RunError(
            f"--average {count}: only {max(1, len(kept))} up to {path}; 'train --keep' sets how"
            " many a run keeps"
        )
    return kept[-count:]


def kept_evaluations(path: Path, iteration: int) -> list[Path]:
    """Return the evaluations of a checkpoint that its run or its published folder keeps: for each
    perturbation the one of the most trials on test pieces, and on imported pieces that are held out
    of training, from the paper's distances."""
    run = run_of(path)
    best: dict[str, tuple[int, Path]] = {}
    for file in sorted(run.evaluations.glob("*.json") if run else path.glob("evaluation*.json")):
        try:
            figures = json.loads(file.read_text())
            head = _headline(figures)
            usual = list(figures.get("start_m", ())) in ([], list(start_m(head["task"], "table1")))
        except (OSError, ValueError, KeyError, TypeError, InhabitError):
            continue
        special = {"simulator", "motions"} & set(figures)
        plain = figures.get("preset", "table1") == "table1" and not special and usual
        unseen = figures.get("held_out") or head["objects"] in ("test", "clips")
        if not plain or not unseen:
            continue
        kind, trials = _kind(figures), int(head["trials"])
        if figures.get("iteration") == iteration and trials > best.get(kind, (0, file))[0]:
            best[kind] = trials, file
    return [file for _, file in best.values()]


def _evaluations(paths: Sequence[Path]) -> dict[str, dict[str, Any]]:
    """Return the figures of `inhabit evaluate --json` by the name of the published file, one per
    perturbation and set of pieces."""
    found: dict[str, dict[str, Any]] = {}
    for path in paths:
        try:
            figures = json.loads(path.read_text())
            _headline(figures)
            kind = _kind(figures)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ConfigError(
                f"{path} is not an evaluation of `inhabit evaluate --json`: {error}"
            ) from error
        name = f"evaluation-{kind}.json" if kind else _UNDISTURBED
        if name in found:
            what = f"perturbation {figures['perturbation']}"
            where = ", imported pieces" if figures.get("held_out") else ""
            raise ConfigError(f"{path}: a second evaluation with {what}{where}: give one")
        found[name] = figures
    return found


def _kind(figures: dict[str, Any]) -> str:
    """Return what sets an evaluation apart: imported pieces, a perturbation, both; else nothing."""
    disturbed = figures["perturbation"]
    parts = ["imported"] if figures.get("held_out") else []
    return "-".join([*parts, disturbed] if disturbed != "none" else parts)


def _headline(figures: dict[str, Any]) -> dict[str, Any]:
    """Return the main figures of an evaluation, for the manifest: of a policy that follows clips
    what it completes, of others their success."""
    names = (*_HEADLINE, *(_FOLLOWED if "completed" in figures else _REACHED))
    return {name: figures[name] for name in names}
