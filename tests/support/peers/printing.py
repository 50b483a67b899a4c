"""A peer whose library prints, as some do in every iteration."""

from collections.abc import Iterator
from contextlib import contextmanager

from console.bench.peers.protocol import Assignment, Iterate, serve


@contextmanager
def open_peer(assignment: Assignment) -> Iterator[Iterate]:
    """Open a training that prints."""

    def iterate() -> int:
        print('{"samples": "of the library"}', flush=True)
        return assignment.batch

    yield iterate


if __name__ == "__main__":
    serve(open_peer)
