"""Expected errors: one line each that states what is wrong and gives the valid choices."""


class InhabitError(Exception):
    """Base of every expected failure; the command line prints it as one line and exits with 1."""


class ChoiceError(InhabitError):
    """A name that is not in a registry; the message lists the valid names."""

    def __init__(self, kind: str, name: str, choices: list[str]) -> None:
        super().__init__(f"unknown {kind} '{name}': choose one of {', '.join(sorted(choices))}")


class ClipError(InhabitError):
    """A motion clip that cannot be read or does not fit the character."""


class PieceError(InhabitError):
    """A piece of furniture that cannot be used."""


class LayoutError(InhabitError):
    """A checkpoint or message whose features, goals or actions have another layout."""


class ConfigError(InhabitError):
    """Settings that contradict one another."""
