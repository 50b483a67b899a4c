"""Many scenes on mujoco-warp: the interface of `Scenes`, with all arrays on one device.

torch and Warp share the arrays. On a GPU the substeps of a control step are one CUDA graph, and
nothing of a step goes to the host. GPU runs cannot be repeated bit for bit: contacts and sums are
gathered in whatever order the threads come.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import mujoco
import mujoco_warp as mjw
import torch
import warp as wp
from torch import Tensor

from world import device as devices
from world.character import model as character
from world.character.actions import ActionMap
from world.errors import InhabitError
from world.scene.batch import MAX_SPEED, PHYSICS, ModelBank, Scenes, quaternion
from world.scene.warp_config import DEFAULT, WarpConfig
from world.scene.warp_model import template

#: Scenes that fit are counted in so many: the default --block.
_BLOCK = 64
#: Control steps between two looks at the overflow flags, each of which waits for the device.
_LOOK_STEPS = 8
_FLAGS = mjw.OverflowType
#: What each overflow is of, and the setting that makes room.
_OVERFLOWS = (
    (_FLAGS.NEFC | _FLAGS.NJMAX_NNZ, "rows of constraints", "njmax"),
    (_FLAGS.BROADPHASE | _FLAGS.NARROWPHASE | _FLAGS.CCD, "contacts", "nconmax"),
)


class OverflowError(InhabitError):
    """Contacts or constraints that found no room in the simulator's arrays."""


class WarpScenes(Scenes):
    """n scenes, each with a piece of one bank."""

    def __init__(
        self,
        bank: ModelBank,
        n: int,
        action_scale: float,
        action_clip: float,
        device: torch.device = devices.CPU,
        config: WarpConfig = DEFAULT,
    ) -> None:
        """Raises PieceError for a piece with more hulls than slots, DeviceError where n scenes do
        not fit into the device's memory."""
        self.n, self.device, self.config = n, device, config
        #: Of the bank, by variant.
        self.models = list(bank.models)
        made = template(bank.models, bank.pieces)
        self.template = made.model
        self._tables = {
            name: devices.put(torch.from_numpy(table), device)
            for name, table in made.tables.items()
        }
        self._tables = {
            name: table if name == "geom_dataid" else table.float()
            for name, table in self._tables.items()
        }
        with self._warp_device():
            self._model = mjw.put_model(made.model, dict.fromkeys(made.tables, n))
            self._model.opt.warn_overflow = 0
            free = devices.memory_free(device)
            if free is not None:
                devices.require_memory(n, _BLOCK, bytes_per_scene(made.model, config), free)
            self._data = mjw.make_data(
                made.model, nworld=n, nconmax=config.nconmax, njmax=config.njmax
            )
            wp.synchronize_device()  # from here on torch writes to these arrays too
        self._fields = {
            name: _shared(getattr(self._model, name), table.shape[1:])
            for name, table in self._tables.items()
        }
        self._array: dict[str, Any] = {
            name: wp.to_torch(getattr(self._data, name)) for name in PHYSICS
        }
        qpos, qvel = self._array["qpos"], self._array["qvel"]
        self._qpos, self._qvel = qpos[:, : character.NQ], qvel[:, : character.NV]
        self.free_qpos, self.free_qvel = qpos[:, character.NQ :], qvel[:, character.NV :]
        self._ctrl = self._array["ctrl"]
        self._overflow = wp.to_torch(self._data.overflow)
        self._map = devices.moved(ActionMap.of(action_scale, action_clip, torch.float64), device)
        self._unlooked = 0
        self.choose(torch.arange(n, device=device), bank, self._overflow.long() * 0)
        self._graph = self._captured() if device.type == "cuda" else None

    @contextmanager
    def _warp_device(self) -> Iterator[None]:
        with wp.ScopedDevice(str(self.device)):
            yield

    def _captured(self) -> Any:
        """The substeps of a control step as a CUDA graph."""
        before = self.physics()
        with self._warp_device():
            self._substeps()  # loads every kernel, which a capture must not
            wp.synchronize_device()
            with wp.ScopedCapture() as capture:
                self._substeps()
        self.load_physics(before)
        self._overflow.zero_()
        return capture.graph

    def _substeps(self) -> None:
        for _ in range(character.SUBSTEPS):
            mjw.step(self._model, self._data)

    def drive(self, set_points: Tensor) -> None:
        """One control step (1/30 s) with the given set-points [n, 28] rad.

        Raises OverflowError, within some steps, where contacts or constraints found no room.
        """
        self._write(set_points)
        self.step_raw()
        self._unlooked += 1
        if self._unlooked >= _LOOK_STEPS:
            self.require_room()

    def step_raw(self) -> None:
        """The substeps of one control step, set-points as they are."""
        if self._graph is None:
            with self._warp_device():
                self._substeps()
        else:
            # in torch's own order: what it wrote before is there, what it reads next is done
            stream = wp.stream_from_torch(torch.cuda.current_stream(self.device))
            wp.capture_launch(self._graph, stream=stream)

    def require_room(self) -> None:
        """Raise OverflowError, naming the setting to raise, if anything found no room so far."""
        self._unlooked = 0
        flags = self._overflow
        for kinds, what, setting in _OVERFLOWS:
            count = int(((flags & int(kinds)) != 0).sum())
            if count:
                room = getattr(self.config, setting)
                raise OverflowError(
                    f"{count} of {self.n} scenes had more {what} than fit: raise --warp.{setting},"
                    f" which is {room}"
                )

    def finite(self) -> Tensor:
        """[n] bool: scenes that the last step left sound."""
        sound = (self._qvel.abs() < MAX_SPEED).all(dim=1) & self._qpos.isfinite().all(dim=1)
        return sound & self.free_qpos.isfinite().all(dim=1)

    def set_state(
        self, ids: Tensor, qpos: Tensor, qvel: Tensor, origin: Tensor, yaw: Tensor
    ) -> None:
        """As of `Scenes`; free bodies beside the character stay where they are."""
        self._qpos[ids] = qpos.to(self._qpos)
        self._qvel[ids] = qvel.to(self._qvel)
        self._ctrl[ids] = self._map.offset.to(self._ctrl)
        self._array["qacc_warmstart"][ids] = 0.0
        self._array["time"][ids] = 0.0
        self.move_furniture(ids, origin, yaw)

    def move_furniture(self, ids: Tensor, origin: Tensor, yaw: Tensor) -> None:
        """As of `Scenes`."""
        self._array["mocap_pos"][ids, 0] = origin.to(self._qpos)
        self._array["mocap_quat"][ids, 0] = quaternion(yaw).to(self._qpos)

    def move_stand(self, ids: Tensor, top: Tensor) -> None:
        """As of `Scenes`."""
        self._array["mocap_pos"][ids, 1] = top.to(self._qpos)

    def set_free(self, ids: Tensor, index: int, pose: Tensor, velocity: Tensor) -> None:
        """As of `Scenes`."""
        self.free_qpos[ids, 7 * index : 7 * index + 7] = pose.to(self._qpos)
        self.free_qvel[ids, 6 * index : 6 * index + 6] = velocity.to(self._qpos)

    def choose(self, ids: Tensor, bank: ModelBank, variant: Tensor) -> None:
        """Give the scenes `ids` [m] the pieces `variant` [m] of the bank that they were made of."""
        for name, table in self._tables.items():
            self._fields[name][ids] = table[variant]

    def set_models(self, ids: Sequence[int], models: Sequence[mujoco.MjModel]) -> None:
        """Not here: pieces are chosen by number (`choose`)."""
        raise NotImplementedError("mujoco-warp has one model for all pieces: use choose")

    def physics(self) -> dict[str, Tensor]:
        """Copies of all physical state, float64, on the device."""
        return {name: self._array[name].double() for name in PHYSICS}

    def load_physics(self, state: dict[str, Tensor]) -> None:
        """Restore what `physics` gave, here or of `Scenes`."""
        for name in PHYSICS:
            array = self._array[name]
            array.copy_(devices.put(state[name], self.device).reshape(array.shape))


def bytes_per_scene(model: mujoco.MjModel, config: WarpConfig) -> float:
    """Memory that each further scene takes, by what the CPU's arrays of few scenes differ in."""
    with wp.ScopedDevice("cpu"):
        sizes = [
            _bytes(mjw.make_data(model, nworld=n, nconmax=config.nconmax, njmax=config.njmax))
            for n in (8, 16)
        ]
    return (sizes[1] - sizes[0]) / 8


def _bytes(thing: Any) -> int:
    """Of all arrays that an object holds, at any depth."""
    if isinstance(thing, wp.array):
        return thing.capacity
    held = vars(thing).values() if hasattr(thing, "__dict__") else ()
    return sum(_bytes(value) for value in held if isinstance(value, wp.array) or _nested(value))


def _nested(value: Any) -> bool:
    return type(value).__module__.startswith("mujoco_warp")


def _shared(array: Any, shape: Sequence[int]) -> Tensor:
    """A batched field of the model as torch, without a copy: [n, *shape]."""
    found = wp.to_torch(array)
    return found.view(found.shape[0], *shape)
