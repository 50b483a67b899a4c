"""Retargeting of motions of other bodies to the character."""
