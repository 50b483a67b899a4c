"""Communication between processes: generated messages, codecs, client channel and server."""

import os

# The project forks only to start another program. gRPC's fork support, which is read at its first
# use, took the poller's files from a Ray in the same process: its calls were never answered.
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")
