"""Syntheses by the command, and what they wrote."""

from dataclasses import replace
from pathlib import Path

from console.commands import Synthesize
from console.synthesis import request as scene_request
from console.synthesis.motion import Motion, simulate
from policy.checkpoints.served import Served
from tests.support.paths import ROOT

SIT = str(ROOT / "pretrained" / "sit")


def asked(*words: str) -> list[str]:
    return ["synthesize", SIT, "--object", "chair-test-000", *words]


def command(task: str, piece: str, **flags: object) -> Synthesize:
    return replace(Synthesize(Path(task), (), piece), **flags)  # pyright: ignore


def made(served: Served, flags: Synthesize, seed: int | None = None) -> Motion:
    request, piece = scene_request.scene(flags, served.task, seed)
    return simulate(request, served, piece)
