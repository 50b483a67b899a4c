"""Settings of the policy service; without heavy imports, because the command line reads them."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class BatchConfig:
    """Batching of requests."""

    max_rows: int = 256
    """Most rows of one forward pass."""
    max_wait_s: float = 1e-3
    """Longest time that a request waits for others to share its forward pass."""
    max_queued_rows: int = 8192
    """Most rows in each of a policy's queues, of single frames and of large requests; further
    requests are refused."""


@dataclass(frozen=True)
class SynthesisConfig:
    """Limits of the simulations of Synthesize."""

    max_at_a_time: int = 2
    """Most simulations at a time; further requests are refused."""
    max_s: float = 60.0
    """Longest simulated time of a request."""
    buffer_frames: int = 8
    """Frames that are simulated ahead of the client's reading."""


@dataclass(frozen=True)
class PolicyServiceConfig:
    """Limits and time-outs of the policy service."""

    batch: BatchConfig = field(default_factory=BatchConfig)
    """Batching of requests."""
    synthesis: SynthesisConfig = field(default_factory=SynthesisConfig)
    """Limits of the simulations of Synthesize."""
    max_rows: int = 1024
    """Most rows in one call of Act."""
    max_poses: int = 256
    """Most poses in one call of ActFromPose."""
    max_streams: int = 2048
    """Most Control streams open at a time."""
    idle_s: float = 120.0
    """Time after which a stream is closed whose client sends nothing."""
    stalled_s: float = 10.0
    """Time after which a stream is closed whose client reads no reply."""
    poll_s: float = 2.0
    """Interval of the search for a new checkpoint."""
