"""Flags of every subcommand, one dataclass each; the docstring under a field is its --help."""

from dataclasses import dataclass

from console.commands.demo import Demo
from console.commands.motions import (
    MotionsCheck,
    MotionsImport,
    MotionsList,
    MotionsPlay,
    MotionsVary,
)
from console.commands.objects import Meshes, ObjectsCheck, ObjectsImport, ObjectsList, ObjectsShow
from console.commands.play import Play
from console.commands.serving import Export, Serve, Style, Synthesize
from console.commands.teaching import Distill
from console.commands.tools import Bench, Completion, Doctor, Plan, Shell
from console.commands.training import Evaluate, Publish, Realism, Report, Train, Video


@dataclass(frozen=True)
class Entry:
    """One subcommand: name, flags and function (module:name).

    The function is imported when it runs: `doctor` must work where the imports of training fail.
    """

    name: str
    flags: type
    function: str


COMMANDS = (
    Entry("train", Train, "console.training.command:train"),
    Entry("evaluate", Evaluate, "console.report.worst:evaluate_command"),
    Entry("distill", Distill, "console.teaching.distillation:distill_command"),
    Entry("realism", Realism, "console.realism.command:realism_command"),
    Entry("report", Report, "console.report.command:report_command"),
    Entry("publish", Publish, "console.serving.publish:publish_command"),
    Entry("video", Video, "console.video.command:video_command"),
    Entry("play", Play, "console.play.command:play_command"),
    Entry("demo", Demo, "console.demo.command:demo_command"),
    Entry("serve", Serve, "console.serving.policy:serve_command"),
    Entry("style", Style, "console.serving.style:style_command"),
    Entry("synthesize", Synthesize, "console.synthesis.command:synthesize_command"),
    Entry("export", Export, "console.animation.command:export_command"),
    Entry("bench", Bench, "console.bench.command:bench_command"),
    Entry("plan", Plan, "console.plan.command:plan_command"),
    Entry("doctor", Doctor, "console.doctor.command:doctor_command"),
    Entry("completion", Completion, "console.manual.completion:completion_command"),
)
MOTIONS = (
    Entry("import", MotionsImport, "console.motions.listing:motions_command"),
    Entry("list", MotionsList, "console.motions.listing:motions_command"),
    Entry("check", MotionsCheck, "console.motions.listing:motions_command"),
    Entry("play", MotionsPlay, "console.motions.listing:motions_command"),
    Entry("vary", MotionsVary, "console.motions.vary:vary_command"),
)
OBJECTS = (
    Entry("import", ObjectsImport, "console.objects.command:objects_command"),
    Entry("list", ObjectsList, "console.objects.command:objects_command"),
    Entry("check", ObjectsCheck, "console.objects.command:objects_command"),
    Entry("show", ObjectsShow, "console.objects.command:objects_command"),
)


@dataclass(frozen=True)
class Motions:
    """import|list|check|play|vary: motion clips, and how well they fit the character."""


@dataclass(frozen=True)
class Objects:
    """import|list|check|show: furniture, from meshes or the package's own."""


@dataclass(frozen=True)
class Group:
    """Commands under one word: name, a class whose docstring is its help, and its commands."""

    name: str
    flags: type
    entries: tuple[Entry, ...]


GROUPS = (
    Group("motions", Motions, MOTIONS),
    Group("objects", Objects, OBJECTS),
)

__all__ = [
    "COMMANDS",
    "GROUPS",
    "MOTIONS",
    "OBJECTS",
    "Bench",
    "Completion",
    "Demo",
    "Distill",
    "Doctor",
    "Entry",
    "Evaluate",
    "Export",
    "Group",
    "Meshes",
    "MotionsCheck",
    "MotionsImport",
    "MotionsList",
    "MotionsPlay",
    "MotionsVary",
    "ObjectsCheck",
    "ObjectsImport",
    "ObjectsList",
    "ObjectsShow",
    "Plan",
    "Play",
    "Publish",
    "Realism",
    "Report",
    "Serve",
    "Shell",
    "Style",
    "Synthesize",
    "Train",
    "Video",
]
