"""Retargeting: motions of other bodies on the character."""
