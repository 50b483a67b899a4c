"""What `--help` shows first: commands and flags by what a person wants. `--help-all` has the rest.

A command without an entry shows all its flags.
"""

from dataclasses import dataclass

from console import commands


@dataclass(frozen=True)
class Section:
    """Commands or flags for one purpose, named as they are typed (a flag without its dashes)."""

    title: str
    names: tuple[str, ...]


def _section(title: str, names: str) -> Section:
    return Section(title, tuple(names.split()))


COMMANDS = (
    _section("See a policy move", "demo play video"),
    _section(
        "Train a policy, and find out how good it is", "train distill evaluate report realism"
    ),
    _section("Use a policy elsewhere", "synthesize export serve publish"),
    _section("Motions and furniture", "motions objects"),
    _section("Machines, clusters and the terminal", "doctor plan bench style completion"),
)
"""The commands, each in one section."""

_TLS = "tls-cert tls-key tls-client-ca token-file allow-insecure-remote"

FLAGS: dict[type, tuple[Section, ...]] = {
    commands.Train: (
        _section("What to train on", "motions objects init recipe preset mix"),
        _section("How long", "minutes samples iterations"),
        _section("Where it is kept", "run resume restart dry-run seed"),
        _section("What it runs on", "scenes threads device simulator runner actors address"),
    ),
    commands.Evaluate: (
        _section("Trials", "trials objects perturb preset near-m far-m seed threads"),
        _section("Files", "json record worst out"),
    ),
    commands.Report: (
        _section("Trials", "trials objects perturb seed threads"),
        _section("Files", "out motions"),
    ),
    commands.Realism: (
        _section("What is compared", "against task trials group"),
        _section("How", "seed threads json"),
    ),
    commands.Publish: (
        _section("Weights", "task average evaluation"),
        _section("Terms", "data licence relicense replace"),
    ),
    commands.Video: (
        _section("Trials", "trials seconds objects near-m far-m seed"),
        _section("Pictures", "width height look no-captions sheet"),
    ),
    commands.Serve: (
        _section("Address", "listen metrics health"),
        _section("Access", _TLS),
        _section("Limits", "checkpoint max-rows max-streams max-message-mb"),
    ),
    commands.Style: (
        _section("Address", "listen metrics health"),
        _section("Access", _TLS),
        _section("After a crash", "state"),
    ),
    commands.Synthesize: (
        _section("Files", "out overwrite root-motion rest rig"),
        _section("Scene", "object start at place to stand-m"),
        _section("Motion", "seconds seed tries perturb"),
    ),
    commands.Export: (
        _section("What is exported", "checkpoint take"),
        _section("Files for animation programs", "rest root-motion rig joint-map"),
    ),
    commands.Bench: (
        _section("What is measured", "preset scenes threads seconds"),
        _section("What it runs on", "runner device simulator"),
        _section("Files", "json"),
    ),
    commands.Plan: (
        _section("The cluster", "actors learner-cores gbit-per-s price"),
        _section("The training", "task preset scenes network samples overlap"),
        _section("The estimate", "measure json"),
    ),
    commands.Doctor: (
        _section("What is checked besides this machine", "address style policy motions"),
        _section("Access to the services", "tls-ca tls-cert tls-key token-file"),
        _section("The check itself", "seconds json"),
    ),
    commands.MotionsImport: (
        _section("Files", "out format map replace"),
        _section("What the files leave open", "fps unit up"),
    ),
    commands.MotionsVary: (_section("Variants", "out stand-m size replace"),),
    commands.MotionsCheck: (
        _section("Files", "format map json"),
        _section("What the files leave open", "fps unit up"),
    ),
    commands.ObjectsImport: (
        _section("Files", "out json licence credit"),
        _section("What the files leave open", "unit height up front category sit"),
    ),
    commands.ObjectsCheck: (
        _section("The check", "drop json threads"),
        _section("What the files leave open", "unit height up front category sit"),
    ),
    commands.Distill: (
        _section("The teachers", "world.walker world.tracker world.expert motions"),
        _section("How long", "minutes batches"),
        _section("What it starts from", "init seed"),
        _section("What it runs on", "workers scenes"),
    ),
}
"""The flags that are wanted first, by command."""
