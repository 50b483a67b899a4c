"""Functions of tensors whose kernels are recorded once and replayed: CUDA graphs on a GPU.

A gradient step of a small network is a hundred short kernels, and starting them takes longer than
running them; replaying a recording starts them all at once. On the CPU a function stays itself. It
is recorded, not compiled: a compiler would need a C compiler on the machine, and minutes.
"""

import logging
import threading
from collections.abc import Callable
from typing import Any, Protocol

import torch
from torch import Tensor

LOG = logging.getLogger("inhabit.graphs")

#: Calls of a set of shapes that run before the third records: libraries and optimisers make
#: their state in them.
EAGER_CALLS = 2
#: Sets of shapes that are recorded: minibatches are of two sizes, and of others only where samples
#: are dropped.
MOST_SHAPES = 6

Function = Callable[..., Tensor]
Shapes = tuple[torch.Size | None, ...]
#: Two recordings at once would each see the other's waits.
_recording = threading.Lock()


class Graph(Protocol):
    """A recording of kernels."""

    def run(self, call: Callable[[], Tensor]) -> Tensor:
        """The call as it is, where the recording will be made."""
        ...

    def record(self, call: Callable[[], Tensor]) -> Tensor:
        """Record the call's kernels, on a GPU without running them; its result's memory."""
        ...

    def replay(self) -> None:
        """Run what was recorded, on the memory that it was recorded with."""
        ...


class Replayed:
    """A function of tensors (or None) to one tensor, recorded by sets of shapes.

    What the function reads in Python is that of the recording. So whatever differs between calls
    must be an argument, or a tensor that is changed in place; and where a tensor that it uses is
    replaced by another, `forget` must be called.
    """

    def __init__(self, function: Function, make: Callable[[], Graph]) -> None:
        self._function, self._make = function, make
        self._calls: dict[Shapes, int] = {}
        self._made: dict[Shapes, tuple[Graph, list[Tensor | None], Tensor]] = {}
        self._broken = False

    def __call__(self, *arguments: Tensor | None) -> Tensor:
        """The function's result, in memory of its own."""
        shapes = tuple(None if a is None else a.shape for a in arguments)
        if shapes not in self._made:
            calls = self._calls[shapes] = self._calls.get(shapes, 0) + 1
            if self._broken or calls <= EAGER_CALLS or len(self._made) >= MOST_SHAPES:
                return self._make().run(lambda: self._function(*arguments))
            try:
                self._made[shapes] = self._recorded(arguments)
            except RuntimeError as error:
                # slower, and the same numbers: no reason to lose a training
                LOG.warning("kernels cannot be recorded, so each is started by itself: %s", error)
                self._broken = True
                return self._make().run(lambda: self._function(*arguments))
        graph, inputs, result = self._made[shapes]
        for held, given in zip(inputs, arguments, strict=True):
            if held is not None and given is not None:
                held.copy_(given)
        graph.replay()
        return result.clone()

    def _recorded(
        self, arguments: tuple[Tensor | None, ...]
    ) -> tuple[Graph, list[Tensor | None], Tensor]:
        inputs = [None if a is None else a.clone() for a in arguments]
        graph = self._make()
        with _recording:
            result = graph.record(lambda: self._function(*inputs))
        return graph, inputs, result

    def forget(self) -> None:
        """Record anew: a tensor that the function uses is another one now."""
        self._calls.clear()
        self._made.clear()

    @property
    def recordings(self) -> int:
        """Sets of shapes that are recorded now."""
        return len(self._made)


class CudaGraph:
    """A CUDA graph, recorded on a stream of its own."""

    def __init__(self, stream: torch.cuda.Stream, pool: Any) -> None:
        """pool: memory that all recordings of a function share; they run one after the other, and
        their results are copied out."""
        self._stream, self._pool = stream, pool
        self._graph: torch.cuda.CUDAGraph | None = None

    def run(self, call: Callable[[], Tensor]) -> Tensor:
        """As of Graph; on the recording's stream, which autograd ties the parameters to."""
        current = torch.cuda.current_stream(self._stream.device)
        self._stream.wait_stream(current)
        with torch.cuda.stream(self._stream):
            result = call()
        current.wait_stream(self._stream)
        result.record_stream(current)
        return result

    def record(self, call: Callable[[], Tensor]) -> Tensor:
        """As of Graph; other threads may use the GPU meanwhile."""
        graph, mode = torch.cuda.CUDAGraph(), "thread_local"
        with torch.cuda.graph(graph, self._pool, self._stream, capture_error_mode=mode):
            result = call()
        self._graph = graph
        return result

    def replay(self) -> None:
        """As of Graph; in the order of the current stream."""
        assert self._graph is not None, "record first"
        self._graph.replay()


def replayed(function: Function, device: torch.device, wanted: bool = True) -> Function:
    """The function, replayed from recordings where `device` is a GPU and it is `wanted`."""
    if device.type != "cuda" or not wanted:
        return function
    stream, pool = torch.cuda.Stream(device), torch.cuda.graph_pool_handle()
    return Replayed(function, lambda: CudaGraph(stream, pool))


def forget(function: Function) -> None:
    """`Replayed.forget`; nothing where the function is itself."""
    if isinstance(function, Replayed):
        function.forget()
