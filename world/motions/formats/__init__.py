"""Readers of motion formats, one file each, and their registry."""
