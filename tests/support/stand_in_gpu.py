"""A device that is none: tensors on it are kept on the CPU, but refuse to meet the CPU's.

With it a test runs what a GPU would run, on a machine without one: whatever forgets to move a
tensor fails here as it would there. torch's device type `meta` stands for the GPU.
"""

import contextlib
import importlib
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_leaves, tree_map

GPU = torch.device("meta")
#: Operations that move between devices.
_MOVES = {torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default}
#: What hands numbers to Python.
_READS = {"item", "__float__", "__int__", "__bool__", "__index__", "tolist", "__repr__", "__len__"}


class There(Tensor):
    """A tensor of the stand-in GPU; `inner` holds its numbers."""

    inner: Tensor

    @staticmethod
    def __new__(cls, inner: Tensor) -> "There":
        found = Tensor._make_wrapper_subclass(
            cls,
            inner.shape,
            strides=inner.stride(),
            storage_offset=inner.storage_offset(),
            dtype=inner.dtype,
            device=GPU,
        )
        found.inner = inner
        return found

    @classmethod
    def __torch_dispatch__(cls, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return _run(func, args, kwargs or {})


class StandInError(RuntimeError):
    """Tensors of two devices met."""


@contextmanager
def stand_in_gpu() -> Iterator[torch.device]:
    """Within it GPU can be used like a device."""
    paths = ("torch.utils._foreach_utils", "torch.optim.adam", "torch.optim.optimizer")
    modules = [importlib.import_module(path) for path in paths]
    names = ("_get_foreach_kernels_supported_devices", "_get_fused_kernels_supported_devices")
    before = [(m, n, getattr(m, n)) for m in modules for n in names if hasattr(m, n)]
    for module, name, known in before:
        setattr(module, name, lambda known=known: [*known(), GPU.type])
    autocast = torch.autocast
    # the type that stands for the GPU knows no autocast
    torch.autocast = lambda kind, *a, **k: (
        contextlib.nullcontext() if kind == GPU.type else autocast(kind, *a, **k)
    )
    try:
        with warnings.catch_warnings(), _Operations(), _Functions():
            warnings.filterwarnings("ignore", message=".*copying from a non-meta parameter.*")
            yield GPU
    finally:
        torch.autocast = autocast
        for module, name, known in before:
            setattr(module, name, known)


def _is_gpu(value: Any) -> bool:
    return isinstance(value, str | torch.device) and torch.device(value).type == GPU.type


def _index(index: Any) -> Any:
    if isinstance(index, list) and index and all(isinstance(i, int) for i in index):
        return There(torch.tensor(index))
    if isinstance(index, tuple):
        some = any(isinstance(i, slice | list | tuple | Tensor) or i is Ellipsis for i in index)
        return (
            tuple(_index(list(i) if isinstance(i, tuple) else i) for i in index) if some else index
        )
    return index


def _inner(value: Any) -> Any:
    return value.inner if isinstance(value, There) else value


def _run(func: Any, args: Any, kwargs: dict[str, Any]) -> Any:
    """One operation on the numbers, its results on the device that torch would give them."""
    leaves = [x for x in tree_leaves((args, kwargs)) if isinstance(x, Tensor)]
    there = any(isinstance(x, There) for x in leaves)
    if func not in _MOVES and there:
        # numbers of no dimension may come from the CPU, as on a GPU
        strangers = [x for x in leaves if not isinstance(x, There) and x.dim() > 0]
        if strangers:
            shapes = [tuple(x.shape) for x in strangers]
            raise StandInError(f"{func}: tensors {shapes} of the CPU meet some of the GPU")
    if kwargs.get("device") is not None:
        there = _is_gpu(kwargs["device"])
        kwargs = {**kwargs, "device": "cpu"}
    if func is torch.ops.aten.copy_.default:
        there = isinstance(args[0], There)
    out = func(*tree_map(_inner, args), **tree_map(_inner, kwargs))
    given = {id(_inner(x)): x for x in leaves}

    def wrapped(x: Any) -> Any:
        if not isinstance(x, Tensor):
            return x
        # in-place operations hand back what they were given
        return given[id(x)] if id(x) in given else There(x) if there else x

    return tree_map(wrapped, out)


class _Operations(TorchDispatchMode):
    """Sees what is made without any tensor of the GPU in it."""

    def __torch_dispatch__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        return _run(func, args, kwargs or {})


class _Functions(TorchFunctionMode):
    """Sees what torch's C++ would do on its own for a device of this type."""

    def __torch_function__(self, func: Any, types: Any, args: Any = (), kwargs: Any = None) -> Any:
        kwargs, name = dict(kwargs or {}), getattr(func, "__name__", "")
        if name in _READS:
            return func(*(_inner(a) for a in args), **kwargs)
        if name == "numpy" and isinstance(args[0], There):
            raise StandInError("numpy() of a tensor of the GPU")
        if name == "new_tensor" and isinstance(args[0], There):
            return There(torch.tensor(args[1], dtype=kwargs.get("dtype") or args[0].dtype))
        if name in ("__getitem__", "__setitem__") and isinstance(args[0], There):
            # lists of numbers become tensors of the device in torch itself
            args = (args[0], _index(args[1]), *args[2:])
        if name in ("to", "cuda"):
            moved = self._moved(args, kwargs)
            if moved is not None:
                return moved
        elif _is_gpu(kwargs.get("device")):
            return There(func(*args, **{**kwargs, "device": "cpu"}))
        return func(*args, **kwargs)

    def _moved(self, args: Any, kwargs: dict[str, Any]) -> Tensor | None:
        """What Tensor.to gives where it goes to the GPU; None where it does not."""
        tensor, *rest = args
        like = next((a for a in rest if isinstance(a, There)), None)
        if like is None and not any(_is_gpu(a) for a in (*rest, kwargs.get("device"))):
            return None
        dtype = next((a for a in rest if isinstance(a, torch.dtype)), kwargs.get("dtype"))
        dtype = dtype or (like.dtype if like is not None else None)
        if dtype is not None:
            tensor = tensor.to(dtype)
        if isinstance(tensor, There):
            return tensor.clone() if kwargs.get("copy") else tensor
        return _Upload.apply(tensor)


class _Upload(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, tensor: Tensor) -> Tensor:
        return There(tensor.detach().clone())

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        return _inner(gradient)
