"""The demo: one character in a furnished room, in a browser."""
