"""`inhabit synthesize`: files of a policy's motion in a given scene."""

import itertools

import torch

from console.animation import original
from console.commands import Synthesize
from console.serving import loading
from console.synthesis import files
from console.synthesis import request as scene_request
from console.synthesis.motion import Motion, simulate
from console.terminal import counted, doing, progress, screen
from policy.checkpoints.served import Served
from world.character import model as character
from world.errors import ConfigError

_SEEDS = 1 << 31


def synthesize_command(command: Synthesize) -> int:
    """Simulate, write the files, print the outcome; return the exit code."""
    files.check(command.out, command.overwrite, command.files)
    if command.tries < 1:
        raise ConfigError(f"--tries {command.tries}: choose at least 1")
    if command.seed is not None and not 0 <= command.seed < _SEEDS:
        raise ConfigError(f"--seed {command.seed}: choose 0 to {_SEEDS - 1}")
    torch.set_num_threads(1)
    path = loading.checkpoint_of(command.source, command.checkpoint)
    served = loading.served(loading.task_of(path), path)
    motion = tried(command, served)
    print(f"{motion.piece}: {motion.outcome()}")
    with doing("reading the object's mesh"):
        mesh = original.of_object(command.object, motion.shape, command.scale)
    for file in command.out:
        with doing(f"writing {file.name}"):
            files.write(file, motion, command.files, mesh)
        print(f"{file}: {counted(len(motion.frames), 'frame')}, {motion.seconds:.1f} s")
    return 0


def tried(command: Synthesize, served: Served) -> Motion:
    """Return the first motion with success and without a fall, else the last of the tries.

    The first try has the actions of the command; the others draw them with the following seeds.
    """
    output = screen()
    with doing("building the scene"):
        request, piece = scene_request.scene(command, served.task, command.seed)
    frames = round(request.seconds * character.CONTROL_HZ) + 1
    attempt = 1

    def stage() -> str:
        return (
            f"simulating, try {attempt} of {command.tries}" if command.tries > 1 else "simulating"
        )

    with progress("frames", frames, stage) as update:
        for attempt in itertools.count(1):
            motion = simulate(request, served, piece, update)
            if command.tries > 1:
                how = f"seed {request.seed}" if request.HasField("seed") else "mean actions"
                output.print(f"try {attempt}, {how}: {motion.outcome()}")
            if motion.succeeded or attempt >= command.tries:
                return motion
            request.seed = (command.seed or 0) + attempt
    raise AssertionError("the last try returns")
