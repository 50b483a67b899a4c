"""Settings of the discriminator, its training and its replay memory."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StyleConfig:
    """The discriminator; the defaults are the measured best on small machines."""

    hidden: tuple[int, ...] = (512, 256)
    """Widths of the hidden ReLU layers (the paper: 1024 512)."""
    learning_rate: float = 3e-4
    """Adam step size."""
    steps_per_iteration: int = 2
    """Gradient steps for each PPO batch."""
    batch: int = 1024
    """Policy transitions a step (half new, half from the replay), and as many of mocap."""
    gradient_penalty: float = 20.0
    """Weight w of w/2 * E_mocap |dD/dx|^2, x the normalised transition, D its logit."""
    penalty_batch: int = 512
    """Mocap transitions of each step's batch that the gradient penalty is measured on."""
    logit_regulariser: float = 0.01
    """Weight of the squared weights of the output layer."""
    weight_decay: float = 1e-4
    """Weight of the squared weights of all layers."""
    replay: int = 200_000
    """Past policy transitions kept."""
    insert_probability: float = 0.15
    """Chance that a new transition enters the replay once that is full: the paper's 0.01 is for
    batches of 131 k; with 4 k it would remember the first falls for ever."""
    clamp: float = 1e-4
    """Least 1 - D in the reward -log(1 - D)."""
    reward_scale: float = 1.0
    """Factor on the style reward (published code: 2)."""
    held_out: float = 0.05
    """Share of the mocap that is never trained on, and measures the accuracy."""
    held_out_batch: int = 256
    """Held-out transitions per measurement of the accuracy."""
    normaliser_samples: int = 20_000
    """Mocap transitions from which the mean and deviation of each feature are fixed."""
    object_features: bool = True
    """Judge the motion with the object in view (the paper's way); off: the body's motion alone."""
