"""What crosses process boundaries: generated messages, codecs, the client channel, the server."""

import os

# Nobody here forks a process but to start another program. gRPC's preparation for forks, read at
# its first use, took the poller's files from a Ray in the same process: calls were never answered.
os.environ.setdefault("GRPC_ENABLE_FORK_SUPPORT", "0")
