"""Settings of the discriminator, its training and its replay memory."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StyleConfig:
    """The discriminator, its training and its replay; the defaults are the measured best on two
    cores."""

    hidden: tuple[int, ...] = (512, 256)
    """Widths of the hidden ReLU layers; the paper: 1024, 512."""
    learning_rate: float = 3e-4
    """Learning rate of Adam."""
    steps_per_iteration: int = 2
    """Gradient steps in a PPO iteration."""
    batch: int = 1024
    """Policy transitions in a gradient step, half new and half of the replay; as many of mocap."""
    gradient_penalty: float = 20.0
    """Weight w of w/2 * E_mocap |dD/dx|^2, x the normalised transition, D its logit."""
    penalty_batch: int = 512
    """Mocap transitions in a gradient step that the gradient penalty is computed on."""
    logit_regulariser: float = 0.01
    """Weight of the squared weights of the output layer."""
    weight_decay: float = 1e-4
    """Weight of the squared weights of all layers."""
    window: int = 2
    """Number of consecutive states that the discriminator sees at once; the paper: 2, a
    transition."""
    replay: int = 200_000
    """Capacity of the replay, policy transitions; longer windows have so many fewer as they are
    longer."""
    insert_probability: float = 0.15
    """Probability that a new transition enters the full replay; the paper's 0.01 is for batches of
    131,072 samples, and at 4,096 it would keep the first falls throughout the training."""
    clamp: float = 1e-4
    """Least value of 1 - D in the style reward -log(1 - D)."""
    reward_scale: float = 1.0
    """Factor on the style reward; the published code: 2."""
    held_out_batch: int = 256
    """Held-out transitions in a measurement of the accuracy."""
    normaliser_samples: int = 20_000
    """Mocap transitions that give the mean and standard deviation of each feature."""
    throttle: float | None = None
    """Accuracy above which a training is skipped, on the latest rollout and on held-out mocap
    both: a discriminator that is always right gives no gradient to learn from. None: never."""
    mask_holding: bool = False
    """Hide the arms from the discriminator while both hands are at a box, in the policy's
    transitions and in mocap: a box of another size than the clips' needs other arms."""
    object_features: bool = True
    """Include the object features in the observation, as in the paper; off: the body's features
    alone."""
