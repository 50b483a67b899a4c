"""What crosses process boundaries: generated messages, codecs, the client channel, the server."""
