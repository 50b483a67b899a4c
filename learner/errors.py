"""What can go wrong in learning."""

from policy.errors import InhabitError


class TrainingError(InhabitError):
    """Training cannot go on, for instance because a number stopped being finite."""
