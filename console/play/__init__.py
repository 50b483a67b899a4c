"""The player: a live policy, a recording or clips in a browser."""
