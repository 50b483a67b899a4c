"""Numbers in flags, and where they may lie."""

from world.errors import ConfigError

#: Farthest from the origin that anything is put, m.
_FAR_M = 1000.0


def numbers(flag: str, text: str, form: str) -> tuple[float, float, float]:
    """Three numbers, commas between them; ConfigError names the flag and the form."""
    try:
        a, b, c = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(f"{flag} {text}: give {form}") from None
    if not all(abs(value) <= _FAR_M for value in (a, b, c)):
        raise ConfigError(f"{flag} {text}: each number must be within ±{_FAR_M:g}")
    return a, b, c


def within(flag: str, value: float, bounds: tuple[float, float]) -> float:
    """The value of a flag, or ConfigError beyond its bounds."""
    low, high = bounds
    if not low <= value <= high:
        raise ConfigError(f"{flag} {value:g}: choose {low:.3g} to {high:.3g}")
    return value
