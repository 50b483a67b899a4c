"""Settings of the policy service; light to import, because the command line reads them."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class BatchConfig:
    """How requests are gathered, and how many may wait."""

    max_rows: int = 256
    """Rows of one forward pass."""
    max_wait_s: float = 1e-3
    """Longest wait of a request for others to join it."""
    max_queued_rows: int = 8192
    """Rows that may wait; what comes beyond is refused."""


@dataclass(frozen=True)
class SynthesisConfig:
    """How much is simulated for clients."""

    max_at_a_time: int = 2
    """Simulations at a time; what comes beyond is refused."""
    max_s: float = 60.0
    """Longest simulated time of one."""
    buffer_frames: int = 8
    """Frames made before the client must take some."""


@dataclass(frozen=True)
class PolicyServiceConfig:
    """How much the service takes on, and how long it waits."""

    batch: BatchConfig = field(default_factory=BatchConfig)
    """How requests are gathered, and how many may wait."""
    synthesis: SynthesisConfig = field(default_factory=SynthesisConfig)
    """How much is simulated for clients."""
    max_rows: int = 4096
    """Rows of one call of Act."""
    max_poses: int = 256
    """Poses in one call of ActFromPose."""
    max_streams: int = 2048
    """Control streams open at a time."""
    idle_s: float = 120.0
    """A stream whose client says nothing for so long is closed."""
    stalled_s: float = 10.0
    """So is one whose client takes no reply for so long."""
    poll_s: float = 2.0
    """Time between looks for a better checkpoint."""
