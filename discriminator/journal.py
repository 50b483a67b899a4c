"""What lets a service that was killed go on where it was: its state after each training.

The replay lives in a mapped file, which outlives the process; everything else is small and
written anew after each training (temporary file, rename). A rollout scored since then is sent
again by the client and enters the same slots of the replay. This guards against a killed
process, not against a lost disk: that is what the run's checkpoints are for.
"""

import os
from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor

from discriminator.errors import StyleError


class Journal:
    """The state of one service in a directory of its own."""

    def __init__(self, directory: Path) -> None:
        """Make the directory if it is not there; StyleError if it cannot be."""
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StyleError(f"state directory {directory}: {error.strerror}") from error
        self.replay = directory / "replay.f32"
        self._path = directory / "state.safetensors"
        self._training = directory / "training"

    def load(self) -> dict[str, Tensor] | None:
        """The last state saved, without the replay's rows; None if there is none."""
        if not self._path.exists():
            return None
        try:
            return load_file(self._path)
        except (SafetensorError, OSError) as error:
            raise StyleError(f"state {self._path}: {error}; remove it to start anew") from error

    def training(self) -> str:
        """Id of the training that the state belongs to; empty where none is known."""
        try:
            return self._training.read_text().strip()
        except FileNotFoundError:
            return ""
        except (OSError, ValueError) as error:
            raise StyleError(f"state {self._training}: {error}; remove it") from error

    def belong(self, training: str) -> None:
        """Note the training that the state belongs to from now on."""
        temporary = self._training.with_suffix(".tmp")
        temporary.write_text(training)
        os.replace(temporary, self._training)

    def clear(self) -> None:
        """Forget the saved state: the replay is about to become another's."""
        self._path.unlink(missing_ok=True)

    def save(self, state: dict[str, Tensor]) -> None:
        """Replace the saved state in one step."""
        temporary = self._path.with_suffix(".tmp")
        save_file(state, temporary)
        os.replace(temporary, self._path)
