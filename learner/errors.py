"""Errors of learning."""

from policy.errors import InhabitError


class TrainingError(InhabitError):
    """Training cannot go on, for instance because a metric is not finite."""
