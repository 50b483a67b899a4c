"""Journal of a service: its state after each training, from which a killed service continues.

The replay is a mapped file, which outlives the process; the rest is small and is rewritten after
each training (temporary file, rename). The client sends a rollout again that was scored since then,
and it enters the same slots of the replay. The journal guards against a killed process; a run's
checkpoints guard against a lost disk.
"""

import hashlib
import time
from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
from torch import Tensor

from discriminator.errors import StyleError
from world.partial_files import locked, remove_leftovers, replacing

#: How long a killed service may take to release its directory, s.
RELEASE_S = 3.0


class Journal:
    """State of one service in a directory of its own."""

    def __init__(self, directory: Path) -> None:
        """Make the directory if it is missing; StyleError if that fails."""
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StyleError(f"state directory {directory}: {error.strerror}") from error
        remove_leftovers(directory)
        self.directory = directory
        self.replay = directory / "replay.f32"
        self._rows_bytes = self.replay.stat().st_size if self.replay.exists() else 0
        self._path = directory / "state.safetensors"
        self._training = directory / "training"

    def lock(self) -> None:
        """Lock the directory for this process, to its end, against a second service, whose
        trainings would enter the same files. Raises StyleError where one has it."""
        last = time.monotonic() + RELEASE_S
        while locked(self.directory) is None:
            if time.monotonic() > last:
                raise StyleError(
                    f"state directory {self.directory}: another service uses it: name another"
                    " --state"
                )
            time.sleep(0.1)

    def require_rows(self, rows_bytes: int) -> None:
        """Raise StyleError where there is a state whose replay, a file of so many bytes, was not
        there when the journal was opened: mapping it fills it with zeros without a word."""
        if self._path.exists() and self._rows_bytes != rows_bytes:
            raise StyleError(
                f"state {self.replay}: {self._rows_bytes} bytes, must be {rows_bytes}; remove"
                f" {self.directory} to start from scratch"
            )

    def load(self) -> dict[str, Tensor] | None:
        """The last saved state, without the replay's rows; None if there is none."""
        if not self._path.exists():
            return None
        try:
            return load_file(self._path)
        except (SafetensorError, OSError) as error:
            raise StyleError(
                f"state {self._path}: {error}; remove it to start from scratch"
            ) from error

    def training(self) -> str:
        """Digest of the id of the training that the state belongs to; empty without one."""
        try:
            found = self._training.read_text().strip()
            # older journals hold the id itself
            old = found and len(found) != hashlib.sha256().digest_size * 2
            return hashlib.sha256(found.encode()).hexdigest() if old else found
        except FileNotFoundError:
            return ""
        except (OSError, ValueError) as error:
            raise StyleError(f"state {self._training}: {error}; remove it") from error

    def set_training(self, training: str) -> None:
        """Set the training that the state belongs to."""
        with replacing(self._training) as partial:
            partial.write_text(training)

    def clear(self) -> None:
        """Remove the saved state, before the replay's rows are replaced."""
        self._path.unlink(missing_ok=True)

    def save(self, state: dict[str, Tensor]) -> None:
        """Replace the saved state atomically."""
        with replacing(self._path) as partial:
            save_file(state, partial)
