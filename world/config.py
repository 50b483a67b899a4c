"""The settings of a world: task, clips, furniture, starts and episodes."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class StartMixture:
    """Shares of the ways an episode starts; they need not sum to 1."""

    clip: float = 0.3
    """Character and furniture as in a random state of a clip with a seat (reference state
    initialisation)."""
    near: float = 0.35
    """An upright state of a clip, the furniture within `near_m`, any heading."""
    far: float = 0.35
    """An upright state of a clip, the furniture within `far_m`, any heading."""


@dataclass(frozen=True)
class WorldConfig:
    """What the scenes hold and how their episodes run."""

    task: str = "sit"
    """Name of the task."""
    motions: tuple[str, ...] = ()
    """Files or folders of motion clips; none: the package's own."""
    mirror: bool = True
    """Add each clip's mirror image."""
    pieces: int = 60
    """How many training pieces of furniture."""
    scales: int = 6
    """Sizes of each piece, spread over `scale`."""
    scale: tuple[float, float] = (0.8, 1.2)
    """Smallest and largest size of a piece."""
    starts: StartMixture = field(default_factory=StartMixture)
    """How episodes start."""
    clip_stages: tuple[float, float, float] = (0.3, 0.5, 0.2)
    """Of the starts from a clip: shares of approaching or leaving, sitting down or getting up,
    seated."""
    standing: float = 0.15
    """Share of the near and far starts from the rest pose instead of a clip's state."""
    near_m: tuple[float, float] = (0.75, 1.6)
    """Distance of the place in near starts, m."""
    far_m: tuple[float, float] = (1.0, 10.0)
    """Distance of the place in far starts, m."""
    ahead: float = 0.6
    """Share of the far starts whose place lies within 45 degrees of where the character walks."""
    episode_s: float = 10.0
    """Length of an episode, s."""
    hold_s: float = 1.5
    """Success held this long ends the episode, as a time-out."""
    early_pelvis_m: float = 0.6
    """Training also ends an episode as a fall when the pelvis is lower than this away from the
    furniture, m."""
    action_scale: float = 0.35
    """Servo target of action 1, as a share of the joint's range, added to the mean pose of the
    clips."""
    action_clip: float = 3.0
    """Actions beyond this are clipped."""
    seed: int = 0
    """Seed of the furniture catalogue."""
