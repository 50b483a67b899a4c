"""A checkpoint made small enough to be carried away: without the scenes, with less of the replay.

    python -m policy.checkpoints.trimmed RUN MB

writes RUN/trimmed. Networks, optimisers, normalisers, discriminator and counters are whole; whoever
resumes from it begins all episodes anew.
"""

import sys
from pathlib import Path

import torch
from torch import Tensor

from policy.checkpoints.format import State, flatten, read, write
from policy.checkpoints.run_checkpoints import resolve
from policy.errors import CheckpointError

#: Of the training section, what belongs to the scenes.
_SCENES = ("fleet", "waiting", "begun")
_ROWS, _COUNT = "replay", "counters/replay"
#: Of the discriminator's: the last states of every scene, from which longer windows go on, by
#: dimension of the scenes.
_WINDOWS = {"past": 1, "age": 0}


def without_episodes(style: State) -> State:
    """A discriminator's section for scenes in which all episodes begin anew: no window goes on from
    an episode that is over."""
    return {
        name: value.narrow(_WINDOWS[name], 0, 0) if name in _WINDOWS else value
        for name, value in style.items()
    }


def trimmed(state: State, most_bytes: int) -> State:
    """The sections of a checkpoint in at most `most_bytes` of tensors.

    Raises CheckpointError where they do not fit even without a replay.
    """
    training = {k: v for k, v in state["training"].items() if k not in _SCENES}
    found = {**state, "training": training}
    style = without_episodes(state["style"])
    rows = style.get(_ROWS)
    rest = _bytes({**found, "style": {k: v for k, v in style.items() if k != _ROWS}})
    if rest > most_bytes:
        raise CheckpointError(
            f"the networks and their optimisers alone take {rest / 1e6:.1f} MB, more than"
            f" {most_bytes / 1e6:.1f}"
        )
    if isinstance(rows, Tensor) and len(rows):
        row = rows[0].numel() * rows.element_size()
        kept = min(len(rows), (most_bytes - rest) // row)
        # slots are filled at random once the replay is full: any of them are as good
        style[_ROWS], style[_COUNT] = rows[:kept], torch.tensor(kept)
    return {**found, "style": style}


def _bytes(state: State) -> int:
    tensors, _ = flatten(state)
    return sum(tensor.numel() * tensor.element_size() for tensor in tensors.values())


def trim(run: Path, most_mb: float) -> Path:
    """Write the latest checkpoint of a run, trimmed, as RUN/trimmed."""
    found = read(resolve(run))
    return write(run / "trimmed", trimmed(found.state, round(most_mb * 1e6)), found.manifest)


def main(arguments: list[str]) -> int:
    """RUN MB."""
    run, most_mb = arguments
    print(trim(Path(run), float(most_mb)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
