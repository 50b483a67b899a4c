"""CUDA graphs without a GPU: the operations of a call, logged and run again on the same memory.

As on a GPU, a replay runs no Python of the function: whatever the function read as a number when it
was recorded stays that number, and reading one while recording is refused.
"""

from collections.abc import Callable
from contextlib import contextmanager
from typing import Any, NamedTuple

import torch
from torch import Tensor
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves

aten = torch.ops.aten
#: Operations that wait for a device, or whose result's size it must tell.
READS = {
    aten._local_scalar_dense.default,
    aten.nonzero.default,
    aten.masked_select.default,
    aten.is_nonzero.default,
    aten.equal.default,
    aten.unique_dim.default,
    aten._unique2.default,
}


class ReadError(RuntimeError):
    """A number was read from the device while its kernels were recorded."""


def reads(function: Any, args: Any) -> bool:
    """Whether an operation waits for the device; a mask as an index becomes a `nonzero` there."""
    if function in (aten.index.Tensor, aten.index_put.default, aten.index_put_.default):
        return any(isinstance(i, Tensor) and i.dtype == torch.bool for i in args[1])
    return function in READS


class _Operation(NamedTuple):
    function: Any
    args: Any
    kwargs: Any
    result: Any


class _Log(TorchDispatchMode):
    def __init__(self, into: list[_Operation]) -> None:
        super().__init__()
        self._into = into

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        if reads(func, args):
            raise ReadError(str(func))
        result = func(*args, **(kwargs or {}))
        self._into.append(_Operation(func, args, kwargs or {}, result))
        return result


class LoggedGraph:
    """A Graph of world.graphs on the CPU."""

    def __init__(self) -> None:
        self._operations: list[_Operation] = []

    def run(self, call: Callable[[], Tensor]) -> Tensor:
        return call()

    def record(self, call: Callable[[], Tensor]) -> Tensor:
        """The call runs, as the CPU cannot do without; what it changed in place is put back."""
        kept = _Kept()
        with kept, _Log(self._operations):
            result = call()
        kept.restore()
        return result

    def replay(self) -> None:
        with torch._C._AutoDispatchBelowAutograd():  # kernels alone, as they were logged
            for operation in self._operations:
                found = operation.function(*operation.args, **operation.kwargs)
                given = [x for x in tree_leaves((operation.args, operation.kwargs)) if _is(x)]
                memory = {x.untyped_storage().data_ptr() for x in given}
                results = tree_leaves(operation.result), tree_leaves(found)
                for held, new in zip(*results, strict=True):
                    # views and what is changed in place are in the same memory already
                    if _is(held) and held.untyped_storage().data_ptr() not in memory:
                        held.copy_(new)


class _Kept(TorchDispatchMode):
    """Copies of what the operations within it change in place, from before."""

    def __init__(self) -> None:
        super().__init__()
        self._before: dict[int, tuple[Tensor, Tensor]] = {}

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        changed = [a for a, s in zip(args, func._schema.arguments, strict=False) if s.is_write]
        for tensor in tree_leaves(changed):
            if _is(tensor) and id(tensor) not in self._before:
                self._before[id(tensor)] = tensor, tensor.clone()
        return func(*args, **(kwargs or {}))

    def restore(self) -> None:
        with torch.no_grad():
            for tensor, before in self._before.values():
                tensor.copy_(before)


def _is(value: Any) -> bool:
    return isinstance(value, Tensor)


class _Count(TorchDispatchMode):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        if reads(func, args):
            self.found.append(str(func))
        return func(*args, **(kwargs or {}))


@contextmanager
def counted_reads() -> Any:
    """Within it: the names of operations of this thread that would wait for a GPU."""
    mode = _Count()
    with mode:
        yield mode.found
