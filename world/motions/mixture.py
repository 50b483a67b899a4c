"""The mixture of mocap transitions that the discriminator is trained on."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StyleMixture:
    """Fractions of the mocap transitions, up to a common factor, and poses of relocated objects."""

    locomotion: float = 0.45
    """Upright frames of any clip, with a relocated object."""
    approach: float = 0.2
    """Frames of clips with a seat, before and after its use."""
    transition: float = 0.2
    """Sitting down and getting up."""
    seated: float = 0.15
    """Frames of contact: seated, lying, carrying."""
    object_m: tuple[float, float] = (0.8, 10.0)
    """Least and greatest distance of a relocated object."""
    raised_m: tuple[float, float] = (0.0, 0.35)
    """Least and greatest height added to a clip's bed: the mocap's are as low as 0.15-0.21 m, the
    catalogue's 0.29-0.70 m."""
    box_height_m: tuple[float, float] = (0.5, 1.1)
    """Least and greatest height of the centre of a relocated box."""
