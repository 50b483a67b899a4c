"""`inhabit bench peers`: whole training iterations of ours and of the peers, in alternating turns.

Each has a process, in an interpreter of its own choice. In a round each takes one turn while the
others wait; ratios are of turns of the same round, so that a slow minute slows both sides.
"""

import ast
import contextlib
import json
import os
import subprocess
import sys
import tempfile
import tokenize
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from io import StringIO
from pathlib import Path
from typing import IO, Any

from console.bench.peers import pools
from console.bench.peers.figures import (
    FLEETS,
    OURS_FLEET,
    figures_of,
    fleet_figures,
    pool_figures,
)
from console.bench.peers.protocol import Assignment, Turn
from console.bench.peers.registry import (
    EXTRA,
    NAMES,
    OURS,
    OURS_TASK,
    SCENES,
    adapter,
    by_name,
)
from console.commands import Bench
from console.run.experiment import Experiment
from console.terminal import progress
from world.errors import ChoiceError, ConfigError, InhabitError

_VERSION = "import importlib.metadata as m, sys; print(m.version(sys.argv[1]))"
_END_S = 30.0

Note = Callable[[str], None]


class PeerError(InhabitError):
    """No peer is installed, or a process of the benchmark failed."""


@dataclass(frozen=True)
class Start:
    """A process to be measured."""

    name: str
    module: str
    interpreter: Path
    first: Mapping[str, Any]
    """The first line that it reads."""


def from_flags(
    command: Bench, experiment: Experiment, threads: int
) -> tuple[dict[str, float], dict[str, Any]]:
    """Measure whole iterations against those of other libraries on the same scenes."""
    return measure(
        experiment,
        threads,
        command.seconds,
        command.rounds,
        command.peer_python,
        actors=command.fleet_actors,
    )


def measure(
    experiment: Experiment,
    threads: int,
    seconds: float,
    rounds: int,
    interpreters: Sequence[str],
    note: Note = print,
    actors: Sequence[int] = (),
) -> tuple[dict[str, float], dict[str, Any]]:
    """Return the figures, and what the results page needs beside: versions, turns, load.

    seconds: of a turn, at least. interpreters: NAME=PATH of peers that have environments of their
    own. note: receives a line for each peer that is left out. actors: numbers of Ray actors with
    which ours and RLlib's are compared.

    Raises ConfigError for interpreters that are not there, PeerError without any peer.
    """
    if rounds < 2:
        raise ConfigError(f"--rounds {rounds}: must be 2 or above, for a spread")
    paths = interpreters_of(interpreters)
    versions = installed(paths, note)
    # the critic's warm-up leaves out the actor's update
    ppo = replace(experiment.ppo, warmup_iterations=0)
    whole = Assignment(replace(experiment, ppo=ppo), threads)
    task = replace(
        whole, experiment=replace(experiment, ppo=replace(ppo, task_weight=1.0, style_weight=0.0))
    )
    here = Path(sys.executable)
    ours = "console.bench.peers.ours"
    given = task.to_json()
    starts = [Start(OURS, ours, here, whole.to_json()), Start(OURS_TASK, ours, here, given)]
    starts += [Start(SCENES, "console.bench.peers.stepping", here, given)]
    starts += [Start(name, f"console.bench.peers.{name}", paths[name], given) for name in versions]
    load = [os.getloadavg()[0]]
    turns = alternate(starts, seconds, rounds, note)
    load.append(os.getloadavg()[0])
    if len(turns) < 4:
        raise PeerError("bench peers: every peer failed; see the lines above")
    figures = figures_of(turns)
    stepped, difference = step_pools(task, paths[pools.NAME], seconds, rounds, note)
    figures |= pool_figures(stepped, difference)
    fleets = {}
    if FLEETS in versions:
        fleets = ray_fleets(task, paths[FLEETS], actors, seconds, rounds, note)
    figures |= fleet_figures(fleets)
    details = {
        "peers": {
            name: {
                **asdict(by_name(name)),
                "installed": versions[name],
                "code_lines": code_lines(adapter(name).read_text()),
            }
            for name in versions
            if name in turns
        },
        "turns": {
            name: [asdict(turn) for turn in taken]
            for name, taken in (turns | stepped | fleets).items()
        },
        "turn_s": seconds,
        "rounds": rounds,
        "load": load,
        "bf16": whole.bf16,
        "sigma": whole.sigma,
    }
    return figures, details


def ray_fleets(
    task: Assignment,
    interpreter: Path,
    actors: Sequence[int],
    seconds: float,
    rounds: int,
    note: Note = print,
) -> dict[str, list[Turn]]:
    """Return the turns of our Ray actors and of RLlib's environment runners, for each number of
    them; a number with which either fails is left out, with a line."""
    found: dict[str, list[Turn]] = {}
    for count in actors:
        given = replace(task, threads=count).to_json()
        ours, theirs = f"{OURS_FLEET}_{count}", f"{FLEETS}_{count}"
        starts = [
            Start(ours, "console.bench.peers.fleet", Path(sys.executable), given),
            Start(theirs, f"console.bench.peers.{FLEETS}", interpreter, given),
        ]
        turns = alternate(starts, seconds, rounds, note)
        if len(turns) == len(starts):
            found |= turns
    return found


def step_pools(
    task: Assignment, interpreter: Path, seconds: float, rounds: int, note: Note = print
) -> tuple[dict[str, list[Turn]], float]:
    """Return the turns of the two stepping pools and the difference of their states; nothing
    without UniLab's, with a line."""
    reason = pools.missing(interpreter)
    if reason:
        note(reason)
        return {}, 0.0
    with tempfile.TemporaryDirectory() as folder:
        given = pools.write(task.experiment, Path(folder), task.threads)
        paths = {pools.OURS: Path(sys.executable), pools.UNILAB: interpreter}
        starts = [
            Start(name, "console.bench.peers.pool", paths[name], line)
            for name, line in given.items()
        ]
        turns = alternate(starts, seconds / 2, 2 * rounds, note)
        if len(turns) < 2:
            return {}, 0.0
        return turns, pools.difference(Path(folder))


def interpreters_of(given: Sequence[str]) -> dict[str, Path]:
    """Return the interpreter of each peer from NAME=PATH; by default the present one.

    Raises ConfigError for a form other than NAME=PATH, a file that cannot be run or a name given
    twice; ChoiceError for another name.
    """
    found: dict[str, Path] = {}
    for word in given:
        name, equals, path = word.partition("=")
        if not equals or not path:
            raise ConfigError(
                f"--peer-python {word}: must be NAME=PATH, as in skrl=venv/bin/python"
            )
        if name not in (*NAMES, pools.NAME):
            raise ChoiceError("--peer-python", name, [*NAMES, pools.NAME])
        if name in found:
            raise ConfigError(f"--peer-python {name}: given twice")
        if not os.access(path, os.X_OK) or Path(path).is_dir():
            raise ConfigError(f"--peer-python {word}: no interpreter at {path}")
        # not resolved: the link of a virtual environment is what selects its packages
        found[name] = Path(path).absolute()
    return {name: found.get(name, Path(sys.executable)) for name in (*NAMES, pools.NAME)}


def installed(
    paths: Mapping[str, Path],
    note: Note = print,
    names: Sequence[str] = NAMES,
    required: bool = True,
) -> dict[str, str]:
    """Return the version of each peer of these that its interpreter has.

    note: receives a line for each that is missing or of another version than the pinned one.
    Raises PeerError where none is installed, if one is required.
    """
    found: dict[str, str] = {}
    missing: list[str] = []
    for peer in map(by_name, names):
        words = [str(paths[peer.name]), "-c", _VERSION, peer.distribution]
        asked = subprocess.run(words, capture_output=True, text=True, check=False)
        needs = _needs(peer.requirement)
        complete = asked.returncode == 0 and _imports(paths[peer.name], needs)
        if not complete:
            missing.append(peer.name)
            continue
        found[peer.name] = asked.stdout.strip()
        if found[peer.name] != peer.version:
            note(f"{peer.title} {found[peer.name]}: not the pinned version {peer.version}")
    install = f"{EXTRA}, or --peer-python NAME=PATH of an interpreter that has it"
    if required and not found:
        raise PeerError(f"bench peers: not installed: {', '.join(missing)}: {install}")
    for name in missing:
        note(f"{by_name(name).title}: not measured: not installed in {paths[name]}: {install}")
    return found


def _needs(requirement: str) -> tuple[str, ...]:
    """Return the modules that tell an extra of a package apart from the package."""
    return ("gymnasium", "pyarrow", "dm_tree") if requirement == "ray[rllib]" else ()


def _imports(interpreter: Path, distributions: Sequence[str]) -> bool:
    return all(
        subprocess.run(
            [str(interpreter), "-c", _VERSION, one], capture_output=True, check=False
        ).returncode
        == 0
        for one in distributions
    )


def alternate(
    starts: Sequence[Start], seconds: float, rounds: int, note: Note = print
) -> dict[str, list[Turn]]:
    """Return the turns of each process, by name and round.

    A round goes through the processes in order, the next one in reverse. A peer that fails is left
    out with a line; of ours, PeerError.
    """
    turns: dict[str, list[Turn]] = {}
    with ExitStack() as stack:
        running: dict[str, Running] = {}
        for start in starts:
            try:
                running[start.name] = stack.enter_context(started(start))
            except PeerError as error:
                _leave_out(start.name, error, note)
        done = stack.enter_context(progress("rounds", rounds))
        for number in range(rounds):
            order = list(running) if number % 2 == 0 else list(reversed(running))
            for name in order:
                try:
                    turns.setdefault(name, []).append(running[name].turn(seconds))
                except PeerError as error:
                    _leave_out(name, error, note)
                    del running[name]
                    turns.pop(name, None)
            done(number + 1)
    return turns


def _leave_out(name: str, error: PeerError, note: Note) -> None:
    if name in (OURS, OURS_TASK, SCENES):
        raise error
    title = by_name(name).title if name in NAMES else name
    note(f"{title}: not measured: {error}")


@dataclass(frozen=True)
class Running:
    """A process that has said that it is ready."""

    start: Start
    process: "subprocess.Popen[str]"
    log: IO[str]

    def turn(self, seconds: float) -> Turn:
        """Let it train for at least this time."""
        self.write({"seconds": seconds})
        return Turn(**self.read())

    def write(self, value: Mapping[str, Any]) -> None:
        """Send a line; PeerError where the process has ended."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(value) + "\n")
            self.process.stdin.flush()
        except OSError as error:
            raise self.failed() from error

    def read(self) -> dict[str, Any]:
        """Return the next line; PeerError where the process has ended."""
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise self.failed()
        return json.loads(line)

    def failed(self) -> PeerError:
        """Return the error of a process that has ended, with the last line that it wrote."""
        code = self.process.wait(_END_S)
        self.log.seek(0)
        lines = [line.strip() for line in self.log.read().splitlines() if line.strip()]
        said = lines[-1] if lines else "it wrote nothing"
        return PeerError(f"{self.start.module} ended with exit code {code}: {said}")


@contextmanager
def started(start: Start) -> Iterator[Running]:
    """Start a process, wait until it is ready, and end it on exit."""
    environment = dict(os.environ, CUDA_VISIBLE_DEVICES="")
    # the packages of this project, for interpreters that have not installed it
    root = str(Path(__file__).resolve().parents[3])
    behind = environment.get("PYTHONPATH", "")
    environment["PYTHONPATH"] = os.pathsep.join(path for path in (root, behind) if path)
    with tempfile.TemporaryFile("w+", errors="replace") as log:
        process = subprocess.Popen(
            [str(start.interpreter), "-m", start.module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            env=environment,
        )
        running = Running(start, process, log)
        try:
            running.write(start.first)
            running.read()
            yield running
        finally:
            _end(process)


def _end(process: "subprocess.Popen[str]") -> None:
    assert process.stdin is not None and process.stdout is not None
    with contextlib.suppress(OSError):  # it has ended with unread lines
        process.stdin.close()
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()


def code_lines(source: str) -> int:
    """Return the number of lines that hold code: no blank lines, comments or docstrings."""
    lines: set[int] = set()
    quiet = (
        tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
        tokenize.ENCODING, tokenize.ENDMARKER,
    )  # fmt: skip
    for token in tokenize.generate_tokens(StringIO(source).readline):
        if token.type not in quiet:
            lines |= set(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(
            node
        ):
            said = node.body[0]
            lines -= set(range(said.lineno, (said.end_lineno or said.lineno) + 1))
    return len(lines)
