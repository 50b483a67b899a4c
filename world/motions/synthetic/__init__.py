"""Synthetic motion: a licence-free set of clips that stand, walk, turn, sit, lie and carry."""
