"""What the discriminator takes for real motion: shares of what it is shown."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StyleMixture:
    """What share of the discriminator's mocap is what."""

    locomotion: float = 0.45
    """Upright frames of any clip, with an relocated object anywhere."""
    approach: float = 0.2
    """Frames of clips with a seat, before and after its use."""
    transition: float = 0.2
    """Sitting down and getting up."""
    seated: float = 0.15
    object_m: tuple[float, float] = (0.8, 10.0)
    """How far off the relocated object is."""
    raised_m: tuple[float, float] = (0.0, 0.35)
    """How much higher than its own a bed is that a clip's character lies on: the mocap's are as low
    as 0.15-0.21 m, the catalogue's 0.29-0.70 m."""
    box_height_m: tuple[float, float] = (0.5, 1.1)
    """Height of an relocated box' centre."""
