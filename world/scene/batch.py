"""Many scenes on one mujoco Batch: their states, control steps and features.

Episodes and rewards are the shard's.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import mujoco
import torch
from mujoco.batch import Batch
from torch import Tensor

from world import rotations
from world.character import features, servos
from world.character import model as character
from world.character.actions import ActionMap
from world.character.features import Body
from world.furniture.piece import Piece
from world.scene.target import Target

#: Generalised velocities beyond this, m/s or rad/s, count as divergence, before MuJoCo detects it.
MAX_SPEED = 100.0
_WARNINGS = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]
PHYSICS = ("qpos", "qvel", "ctrl", "qacc_warmstart", "mocap_pos", "mocap_quat", "time")


class ModelBank(Protocol):
    """Compiled scenes of one layout and the pieces in them, by variant."""

    @property
    def models(self) -> Sequence[mujoco.MjModel]: ...
    @property
    def pieces(self) -> Sequence[Piece]: ...


class Scenes:
    """n scenes, each with its own model; qpos, qvel and controls are views of the batch's
    arrays."""

    def __init__(
        self,
        models: Sequence[mujoco.MjModel],
        action_scale: float,
        action_clip: float,
        threads: int = 1,
    ) -> None:
        self.n = len(models)
        self.models = list(models)
        self.batch = Batch(self.models[0], self.n, threads)
        self.batch.set_models(self.models)
        self._array = {name: self.batch.bind(name) for name in PHYSICS}
        qpos, qvel = (torch.from_numpy(self._array[name]) for name in ("qpos", "qvel"))
        self._qpos, self._qvel = qpos[:, : character.NQ], qvel[:, : character.NV]
        #: Coordinates [n, 7 k] and velocities [n, 6 k] of the k free bodies beside the character,
        #: live.
        self.free_qpos, self.free_qvel = qpos[:, character.NQ :], qvel[:, character.NV :]
        self._ctrl = torch.from_numpy(self._array["ctrl"])
        self._map = ActionMap.of(action_scale, action_clip, torch.float64)
        self._bodies = torch.tensor([models[0].body(name).id for name in character.BODIES])
        self._pushed = False

    def set_points(self, action: Tensor, base: Tensor | None = None) -> Tensor:
        """Set-points [n, 28] rad, within their bounds, of actions [n, 28]; base [n, 28] rad:
        set-points of action 0, by default the neutral ones."""
        return self._map.set_points(action, base)

    def actions(self, set_points: Tensor) -> Tensor:
        """The actions [n, 28], within their clip, that give set-points [n, 28] rad."""
        return self._map.actions(set_points)

    def aim(self, action: Tensor) -> None:
        """Write the set-points of actions [n, 28], within the servos' effort limits at the present
        state, without a step."""
        self._write(self.set_points(action))

    def act(self, action: Tensor) -> None:
        """One control step (1/30 s) with the given actions [n, 28]."""
        self.drive(self.set_points(action))

    def drive(self, set_points: Tensor) -> None:
        """One control step (1/30 s) with the given set-points [n, 28] rad."""
        self._write(set_points)
        self.batch.step(nstep=character.SUBSTEPS)
        if self._pushed:
            self._array["xfrc_applied"][:] = 0.0
            self._pushed = False

    def push(self, ids: Tensor, body: Tensor, impulse: Tensor) -> None:
        """Push the bodies `body` [m] (indices into character.BODIES) of the scenes `ids` [m] at
        their centres of mass: impulses [m, 3] N s, world, as a constant force over the next control
        step."""
        if "xfrc_applied" not in self._array:
            self._array["xfrc_applied"] = self.batch.bind("xfrc_applied")
        force = impulse.double() * character.CONTROL_HZ
        self._array["xfrc_applied"][ids.numpy(), self._bodies[body].numpy(), :3] = force.numpy()
        self._pushed = True

    def _write(self, set_points: Tensor) -> None:
        self._ctrl.copy_(servos.limited(set_points, self._qpos, self._qvel))

    def finite(self) -> Tensor:
        """[n] bool: the scenes that the last step left finite and without a MuJoCo warning, on
        which MuJoCo resets a scene silently."""
        sound = (self._qvel.abs() < MAX_SPEED).all(dim=1) & self._qpos.isfinite().all(dim=1)
        sound &= self.free_qpos.isfinite().all(dim=1)
        # [n, kind, (last info, count)]; MuJoCo's reset leaves a count of 1 each time
        warned = self.batch.warning[:, _WARNINGS, 1].any(axis=1)
        if warned.any():
            self.batch.warning[:, _WARNINGS] = 0
            sound &= torch.from_numpy(~warned)
        return sound

    def body(self, ids: Tensor | None = None) -> Body:
        """The character's features in all scenes, or in those of `ids`."""
        qpos = self._qpos if ids is None else self._qpos[ids]
        qvel = self._qvel if ids is None else self._qvel[ids]
        return features.body(qpos.to(torch.float32), qvel.to(torch.float32))

    def set_state(
        self, ids: Tensor, qpos: Tensor, qvel: Tensor, origin: Tensor, yaw: Tensor
    ) -> None:
        """Write states qpos [m, 43], qvel [m, 34] and the furniture's origin [m, 3] m and yaw [m,
        2] (cosine, sine); free bodies beside the character keep their state.

        ids [m] may contain a scene twice with the same values. The solver starts cold.
        """
        rows = ids.numpy()
        self._array["qpos"][rows, : character.NQ] = qpos.double().numpy()
        self._array["qvel"][rows, : character.NV] = qvel.double().numpy()
        self._array["ctrl"][rows] = self._map.offset.numpy()
        self._array["qacc_warmstart"][rows] = 0.0
        self._array["time"][rows] = 0.0
        self.move_furniture(ids, origin, yaw)

    def move_furniture(self, ids: Tensor, origin: Tensor, yaw: Tensor) -> None:
        """Write origin [m, 3] m and yaw [m, 2] (cosine, sine) of the furniture of the scenes
        `ids`."""
        self.move_piece(ids, 0, origin, yaw)

    def move_piece(self, ids: Tensor, index: int, origin: Tensor, yaw: Tensor) -> None:
        """Write origin [m, 3] m and yaw [m, 2] (cosine, sine) of the mocap body `index` of the
        scenes `ids`."""
        rows = ids.numpy()
        self._array["mocap_pos"][rows, index] = origin.double().numpy()
        self._array["mocap_quat"][rows, index] = quaternion(yaw).numpy()

    def move_stand(self, ids: Tensor, top: Tensor) -> None:
        """Write the position of the target's stand, centre of its top [m, 3] m, of the scenes
        `ids` [m]."""
        self._array["mocap_pos"][ids.numpy(), 1] = top.double().numpy()

    def set_free(self, ids: Tensor, index: int, pose: Tensor, velocity: Tensor) -> None:
        """Write pose [m, 7] (centre m, quaternion w, x, y, z) and velocity [m, 6] (world m/s, own
        axes rad/s) of the free body `index` of the scenes `ids` [m]."""
        self.free_qpos[ids, 7 * index : 7 * index + 7] = pose.double()
        self.free_qvel[ids, 6 * index : 6 * index + 6] = velocity.double()

    def now(self, target: Target, ids: Tensor | None = None, index: int = 0) -> Target:
        """`target` [n], or that of the scenes `ids` [m], with the present state of the box, which
        is the free body `index`."""
        if target.box is None:
            return target
        pose = self.free_qpos[:, 7 * index : 7 * index + 7]
        velocity = self.free_qvel[:, 6 * index : 6 * index + 3]
        if ids is not None:
            pose, velocity = pose[ids], velocity[ids]
        pose = pose.to(torch.float32)
        box = replace(
            target.box,
            position=pose[:, :3],
            rotation=rotations.normalise(pose[:, 3:]),
            velocity=velocity.to(torch.float32),
        )
        return replace(target, box=box, corners=box.corners())

    def set_models(self, ids: Sequence[int], models: Sequence[mujoco.MjModel]) -> None:
        """Give the scenes `ids` other models of the same layout."""
        for scene, model in zip(ids, models, strict=True):
            self.models[scene] = model
        self.batch.set_models(self.models)

    def choose(self, ids: Tensor, bank: ModelBank, variant: Tensor) -> None:
        """Give the scenes `ids` [m] the models `variant` [m] of a bank."""
        self.set_models(ids.tolist(), [bank.models[v] for v in variant.tolist()])

    def physics(self) -> dict[str, Tensor]:
        """Copies of all physical state, float64, by name."""
        return {name: torch.from_numpy(self._array[name].copy()) for name in PHYSICS}

    def load_physics(self, state: dict[str, Tensor]) -> None:
        """Restore what `physics` gave."""
        for name in PHYSICS:
            self._array[name][:] = state[name].numpy().reshape(self._array[name].shape)

    @property
    def qpos(self) -> Tensor:
        """[n, 43] float64, a live view."""
        return self._qpos

    @property
    def qvel(self) -> Tensor:
        """[n, 34] float64, a live view."""
        return self._qvel


def quaternion(yaw: Tensor) -> Tensor:
    """[m, 4] float64: rotations about z by yaws [m, 2] (cosine, sine); by the half-angle formulas,
    exact without trigonometry."""
    cos, sin = yaw.double().unbind(1)
    w = torch.sqrt((0.5 * (1 + cos)).clamp_min(0.0))
    z = torch.sqrt((0.5 * (1 - cos)).clamp_min(0.0)) * torch.where(sin < 0, -1.0, 1.0)
    quat = torch.stack((w, torch.zeros_like(w), torch.zeros_like(w), z), dim=1)
    return quat / quat.norm(dim=1, keepdim=True)
