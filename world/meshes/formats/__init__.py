"""Readers of mesh files that a library reads wrongly."""
