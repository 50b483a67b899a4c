"""The player: a policy's character, a recording or a clip in a browser, live."""
