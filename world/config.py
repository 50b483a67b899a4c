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
class CarryConfig:
    """Of the carry task alone: the box, its stands, and where it goes."""

    scale: tuple[float, float] = (0.5, 1.5)
    """Smallest and largest size of the box; 1 is 35 × 50 × 30 cm."""
    sizes: int = 96
    """How many boxes, spread over `scale`."""
    weight_kg: tuple[float, float] | None = None
    """Lightest and heaviest box, whatever its size; none: 4 kg at size 1, by volume at others."""
    stand_m: tuple[float, float] = (0.4, 0.8)
    """Lowest and highest top of the stands that the box starts on and goes to."""
    target_m: tuple[float, float] = (1.0, 10.0)
    """Nearest and farthest target from where the box starts."""
    near_target: float = 0.3
    """Share of the starts with the box in hand whose target is at most `near_target_m` away, so
    that putting it down is learned too."""
    near_target_m: tuple[float, float] = (0.45, 1.2)
    """Distance from the character to the target in these."""
    in_hand: float = 0.0
    """Share of the near and far starts with the box in hand already, held before the body."""
    lesson: bool = False
    """A scripted grip (world.objects.grasp) tells the learner what the arms should do near the
    box; see ppo.lesson-weight. Evaluation never asks it."""
    porter: bool = False
    """A scripted whole body (world.teachers.carry) tells the learner instead what to do, from the
    last metres before the box on, and of who stands about on the way to it."""
    led: float = 0.0
    """Share of the training episodes in which the script moves the arms itself, so that legs and
    trunk learn what it takes before the arms do; a lesson is then given in all of them."""


@dataclass(frozen=True)
class TrackConfig:
    """Of the track task alone: how a clip is followed, and what its box is like."""

    residual: bool = True
    """Actions are added to the reference's set-points; else to the mean pose, as in other tasks."""
    boxes: int = 4
    """How many boxes each clip has."""
    size: tuple[float, float] = (1.0, 1.15)
    """Smallest and largest size of its box; 1 just fits between the clip's hands, larger ones are
    pressed."""
    weight_kg: tuple[float, float] = (1.0, 3.0)
    """Lightest and heaviest box."""
    friction: tuple[float, float] = (1.0, 1.4)
    """Least and greatest sliding friction of the box; hands have 1, and the greater of two
    counts."""
    focus: float = 0.5
    """Share of the initial states that are drawn by where episodes of late failed, from a second
    before it on; the others anywhere."""
    handling: float = 2.0
    """How much more often episodes start where the clip reaches for its object, lifts it or puts it
    down, than elsewhere."""


@dataclass(frozen=True)
class WorldConfig:
    """What the scenes hold and how their episodes run."""

    task: str = "sit"
    """Name of the task."""
    motions: tuple[str, ...] = ()
    """Files or folders of motion clips; none: the package's own."""
    mirror: bool = True
    """Add each clip's mirror image."""
    paces: tuple[float, ...] = ()
    """Add each clip at these paces too: 0.9 is a tenth slower."""
    objects: tuple[str, ...] = ()
    """Furniture: files or folders of imported pieces, `train`: the package's own; none: those."""
    pieces: int = 60
    """How many training pieces of the package's own furniture."""
    scales: int = 6
    """Sizes of each piece, spread over `scale`."""
    scale: tuple[float, float] = (0.8, 1.2)
    """Smallest and largest size of a piece."""
    starts: StartMixture = field(default_factory=StartMixture)
    """How episodes start."""
    clip_stages: tuple[float, float, float] = (0.3, 0.5, 0.2)
    """Of the starts from a clip: shares of approaching or leaving, sitting down or getting up,
    seated."""
    raised: float = 0.0
    """Of the starts from a clip, low over its seat: share that a seat of any greater height is put
    under, the character raised with it; clips rarely show high stools."""
    standing: float = 0.15
    """Share of the near and far starts from the rest pose instead of a clip's state."""
    near_m: tuple[float, float] = (0.75, 1.6)
    """Distance of the place in near starts, m."""
    front: float = 0.5
    """Share of the near starts that stand before the seat, within 60 degrees of its front, most of
    them close to it and with their back to it."""
    front_m: tuple[float, float] = (0.4, 1.3)
    """Distance of the place in these, m: the square of a uniform draw between the two."""
    far_m: tuple[float, float] = (1.0, 10.0)
    """Distance of the place in far starts, m."""
    ahead: float = 0.6
    """Share of the far starts whose place lies within 45 degrees of where the character walks."""
    episode_s: float | None = None
    """Length of an episode, s; none: the task's own (sit and lie 10, carry 15)."""
    hold_s: float = 1.5
    """Success held this long ends the episode, as a time-out."""
    early_pelvis_m: float = 0.6
    """Training also ends an episode as a fall when the pelvis is lower than this away from the
    furniture, m."""
    patience_s: float | None = None
    """Training also ends an episode, as a fall, in which for so long neither the character nor its
    box has moved on, short of success; none: it may stand. Evaluation waits."""
    action_scale: float = 0.35
    """Servo target of action 1, as a share of the joint's range, added to the mean pose of the
    clips."""
    action_clip: float = 3.0
    """Actions beyond this are clipped."""
    seed: int = 0
    """Seed of the furniture catalogue."""
    carry: CarryConfig = field(default_factory=CarryConfig)
    """The carry task's own."""
    track: TrackConfig = field(default_factory=TrackConfig)
    """The track task's own."""
