"""Settings of a world: task, clips, objects, initial states and episodes."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class InitialStates:
    """How the initial states of the episodes are drawn.

    The first three are fractions of the episodes, up to a common factor: they need not sum to 1.
    """

    reference: float = 0.3
    """Reference states: character and object as in a random state of a clip that uses such an
    object (reference state initialisation)."""
    near: float = 0.35
    """Upright states with the object within `near_m`, in any direction."""
    far: float = 0.35
    """Upright states with the object within `far_m`, in any direction."""
    reference_stages: tuple[float, float, float] = (0.3, 0.5, 0.2)
    """Of the reference states: fractions of approaching or leaving, of sitting down or getting up,
    and of being seated; stages that no clip shows are left out."""
    raised_seat_fraction: float = 0.0
    """Of the reference states that are low over a seat: fraction that gets a higher seat and is
    raised with it; clips rarely show high stools."""
    standing_fraction: float = 0.15
    """Of the near and far states: fraction in the rest pose instead of a clip's upright state."""
    near_m: tuple[float, float] = (0.75, 1.6)
    """Least and greatest distance of the target in near states, m."""
    front_fraction: float = 0.5
    """Of the near states: fraction in front of the seat, within 60 degrees of its facing, most of
    them close to it and with their back to it; or with a box ahead, within 45 degrees of the
    direction of motion, that has a long side towards the character, within 20 degrees."""
    front_m: tuple[float, float] = (0.4, 1.3)
    """Least and greatest distance of the target in front of the seat, m; the distance grows with
    the square of a uniform draw, so that small ones are frequent."""
    far_m: tuple[float, float] = (1.0, 10.0)
    """Least and greatest distance of the target in far states, m."""
    ahead_fraction: float = 0.6
    """Of the far states: fraction whose target lies within 45 degrees of the direction of
    motion."""
    focus: float = 0.0
    """Of the near and far states with furniture or a box: fraction whose object is drawn by recent
    failure rates, of pieces in episodes that began near, or of boxes in eight groups by weight; for
    the others all are as likely."""


@dataclass(frozen=True)
class CarryConfig:
    """Settings of the task carry alone: the box, its stands, its target."""

    scale: tuple[float, float] = (0.5, 1.5)
    """Smallest and largest size of the box; 1 is 35 × 50 × 30 cm."""
    sizes: int = 96
    """Number of box sizes, spread over `scale`."""
    weight_kg: tuple[float, float] | None = None
    """Lightest and heaviest box at any size, kg; none: 4 kg at size 1, by volume at others."""
    stand_m: tuple[float, float] = (0.4, 0.8)
    """Lowest and highest top of the two stands, that of the initial state and that of the target,
    m."""
    target_m: tuple[float, float] = (1.0, 10.0)
    """Least and greatest distance of the target from the box's initial position, m."""
    near_target: float = 0.3
    """Of the initial states with the box in hand: fraction whose target is within
    `near_target_m`, so that the policy also learns to put the box down."""
    near_target_m: tuple[float, float] = (0.45, 1.2)
    """Least and greatest distance from the character to the target in these, m."""
    in_hand: float = 0.0
    """Of the near and far initial states: fraction with the box in hand, in front of the body."""
    putting_down: float = 0.0
    """Of the reference states with the box in hand: fraction drawn from frames in which it is put
    down, which clips show briefly; the others are drawn from all frames with the box in hand."""


@dataclass(frozen=True)
class TrackConfig:
    """Settings of the task track alone: the actions, the boxes of the clips, initial states."""

    residual: bool = True
    """Actions are added to the reference's set-points; false: to the neutral ones, as in other
    tasks."""
    boxes: int = 4
    """Number of boxes of each clip that has one."""
    size: tuple[float, float] = (1.0, 1.15)
    """Smallest and largest size of a box; 1 fits exactly between the clip's hands, larger ones are
    pressed."""
    weight_kg: tuple[float, float] = (1.0, 3.0)
    """Lightest and heaviest box, kg."""
    by_volume: bool = False
    """Boxes weigh by volume, as in the task carry, instead of `weight_kg`."""
    friction: tuple[float, float] = (1.0, 1.4)
    """Least and greatest sliding friction of a box; hands have 1, and a contact has the greater of
    the two."""
    focus: float = 0.5
    """Fraction of the initial states that are drawn by the recent failures of their segments and of
    the second after them; the others are drawn independently of failures."""
    goal: str = ""
    """In a mixture: task whose goal the policy sees in these scenes, in place of the reference,
    which the critic alone sees; actions are then added to the neutral set-points. Empty: the
    reference."""
    teacher: str = ""
    """With `goal`: run or checkpoint of the task track, without a mixture, whose policy labels the
    states of these scenes with its actions; see ppo.imitation-weight. Empty: no teacher."""
    displaced_m: float = 0.0
    """Greatest distance of an initial state from the reference's place, m, where the hands are free
    of the box, mostly away from it, and turned by up to 1 rad for each metre. The policy so learns
    to come back to the reference; evaluation has none."""
    solid: bool = False
    """Stands are solid, as in the scenes of carry, and a clip ends before the person in it walks
    through one. False: they hold the box and let the character pass."""
    walker: str = ""
    """Run, checkpoint or name of a policy of the task walk: of the starts shortly before a box is
    taken up from standing, some are as this policy comes to it. Empty: as the clip shows it."""
    rollouts: str = ""
    """Run, checkpoint or name of a policy of the task track: half of the starts are in simulated
    states from which this policy went on, where there are such, in place of the reference's, which
    need not be physical. It is watched when a training begins. Empty: the reference's alone."""
    handling: float = 2.0
    """Weight of frames in which the clip reaches for its object, lifts it or puts it down, in the
    draw of initial states; other frames have 1."""


@dataclass(frozen=True)
class PerturbConfig:
    """Disturbances of training episodes; off by default. Evaluation has its own (--perturb)."""

    fraction: float = 1.0
    """Fraction of the episodes that have pushes and projectiles at the rates below."""
    pushes_per_s: float = 0.0
    """Mean number of pushes in a second: impulses in any horizontal direction on pelvis or
    torso."""
    push_n_s: tuple[float, float] = (5.0, 25.0)
    """Least and greatest impulse of a push, N s; each is spread over one control step."""
    projectiles_per_s: float = 0.0
    """Mean number of balls in a second, thrown as in evaluate --perturb projectiles, where it is
    1."""
    moved_fraction: float = 0.0
    """Fraction of the episodes whose object moves once as the character comes near, as in evaluate
    --perturb moved; not where the character begins at the object."""


@dataclass(frozen=True)
class PenaltyConfig:
    """Penalties of motion that lessen the task reward; none by default, as in the paper."""

    skating: float = 0.0
    """Weight of foot skating: the mean speed of the sole corners that stand on the floor; 1 m/s
    and more costs the whole weight."""
    jerk: float = 0.0
    """Weight of jerk, the third derivative of the bodies' positions, mean over the bodies; 500 m/s³
    and more costs the whole weight."""
    hands: float = 0.0
    """Weight of hands held up at rest: while the root is slower than 0.15 m/s, the mean height of
    the hands beyond 0.2 m above the pelvis; 0.3 m more costs the whole weight. For sit and lie."""


@dataclass(frozen=True)
class WorldConfig:
    """What the scenes hold and how their episodes run."""

    task: str = "sit"
    """Name of the task."""
    motions: tuple[str, ...] = ()
    """Motion clips, files or folders; empty: the package's own."""
    mirror: bool = True
    """Add the mirror image of each clip."""
    playback_speeds: tuple[float, ...] = ()
    """Add each clip at these speeds, as multiples of its own: 0.9 is a tenth slower."""
    objects: tuple[str, ...] = ()
    """Furniture: files or folders of imported pieces, and `train` for the package's own training
    pieces; empty: those alone."""
    held_out: bool = True
    """Train on imported pieces that are held out for evaluation as well: those named in
    held-out.txt beside them, or in the package's list. New trainings leave them out."""
    pieces: int = 60
    """Number of training pieces of the package's own furniture."""
    classes: tuple[str, ...] = ()
    """Classes of the package's own training furniture, in rotation; train sets those of the task
    (sit: chair, armchair, low-stool, high-stool, sofa, bed). Empty, as in runs of earlier versions:
    of sit the first four."""
    scales: int = 6
    """Number of sizes of each piece, spread over `scale`."""
    scale: tuple[float, float] = (0.8, 1.2)
    """Smallest and largest size of a piece, as a multiple of its own."""
    initial: InitialStates = field(default_factory=InitialStates)
    """How the initial states are drawn."""
    episode_s: float | None = None
    """Length of an episode, s; none: the task's own (sit and lie 10, carry 15)."""
    hold_s: float = 1.5
    """Time of uninterrupted success that ends an episode, s; the episode counts as truncated."""
    early_pelvis_m: float = 0.6
    """Pelvis height below which a training episode ends as a fall, away from the object, m."""
    stall_s: float | None = None
    """Stall time-out of training episodes, s: an episode ends as a fall after so long without
    success in which neither the character nor its box has moved, or a box that is off its stand has
    come no nearer to its target; none: no such limit. Evaluation has none."""
    action_scale: float = 0.35
    """Offset of the set-point at action 1, as a fraction of the joint's range; action 0 is the mean
    pose of the clips."""
    action_clip: float = 3.0
    """Greatest magnitude of an action; larger ones are clipped."""
    walker: str = ""
    """Run, checkpoint or name of a policy of the task walk that labels the way to the seat, the bed
    or the box with its actions; with world.tracker, and clips that walk with a box, also the way
    with the box, with the arms of these clips. See ppo.imitation-weight. Empty: no such teacher."""
    tracker: str = ""
    """Run, checkpoint or name of a policy of the task track, without a mixture, that labels what is
    done there (sit: sitting down; carry: picking the box up and putting it down): clips are laid
    over the seat or the box, and it follows them. Empty: no such teacher."""
    expert: str = ""
    """Run, checkpoint or name of a policy of the task itself that labels what no other teacher
    labels, so that a student keeps what it can. Empty: no such teacher."""
    seed: int = 0
    """Seed of the furniture catalogue."""
    perturb: PerturbConfig = field(default_factory=PerturbConfig)
    """Disturbances of training episodes."""
    penalty: PenaltyConfig = field(default_factory=PenaltyConfig)
    """Penalties of motion in the task reward of training."""
    carry: CarryConfig = field(default_factory=CarryConfig)
    """Settings of the task carry alone."""
    track: TrackConfig = field(default_factory=TrackConfig)
    """Settings of the task track alone."""
