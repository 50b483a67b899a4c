"""Numbers in flags, and their bounds."""

from world.errors import ConfigError

#: Largest coordinate of an object, m.
_FAR_M = 1000.0


def numbers(flag: str, text: str, form: str) -> tuple[float, float, float]:
    """Return three comma-separated numbers; ConfigError names the flag and the form."""
    try:
        a, b, c = (float(part) for part in text.split(","))
    except ValueError:
        raise ConfigError(f"{flag} {text}: give {form}") from None
    if not all(abs(value) <= _FAR_M for value in (a, b, c)):
        raise ConfigError(f"{flag} {text}: each number must be within ±{_FAR_M:g}")
    return a, b, c


def within(flag: str, value: float, bounds: tuple[float, float]) -> float:
    """Return the value of a flag; ConfigError out of its bounds."""
    low, high = bounds
    if not low <= value <= high:
        raise ConfigError(f"{flag} {value:g}: choose {low:.3g} to {high:.3g}")
    return value
