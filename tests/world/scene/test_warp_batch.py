"""mujoco-warp against C MuJoCo, on Warp's CPU device: the same physics, rewards and features."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
import torch
from torch import Tensor

from tests.support import track_scenes
from tests.support.hulls import hulled
from tests.support.stand_in_gpu import GPU, There, stand_in_gpu
from world import random_streams, tasks
from world.character import servos
from world.character.features import STATE
from world.character.model import NU, standing_qpos
from world.config import CarryConfig, InitialStates, WorldConfig
from world.device import DeviceError, moved, require_memory
from world.episodes.shard import Shard
from world.errors import PieceError
from world.furniture.catalogue import catalogue
from world.motions import load
from world.objects.bank import ObjectBank
from world.objects.box_bank import BoxBank, boxes
from world.objects.floor_bank import FloorBank
from world.objects.furniture_bank import FurnitureBank, variants
from world.scene import simulators
from world.scene.batch import Scenes
from world.scene.box import BOX_BODY
from world.scene.model import compile_scene
from world.scene.warp_config import WarpConfig
from world.scene.warp_model import template

pytest.importorskip(
    "mujoco_warp", reason="mujoco-warp is not installed: pip install 'inhabit[warp]'"
)
import warp as wp

from world.scene.warp_batch import OverflowError, WarpScenes, bytes_per_scene

TASKS = ("sit", "lie", "carry", "walk", "track")
#: Tasks whose box always touches something.
BOXED = ("carry", "track")
#: Fields that mujoco-warp reads for bodies that sleep alone; ours do not.
SLEEP = ("dof_length",)
SCENES = range(6)
STEPS = 30
#: After a step in contact, of features but for velocities, and of velocities (m/s, rad/s): on
#: boxes; on hulls, whose contact points two general routines choose; with elliptic cones.
#: Positions may differ by 1e-3 in contact, and a substep lasts 1/120 s: that alone lets velocities
#: differ by 1e-3 / (1/120 s) = 0.12. From one and the same state, features agree to SAME.
SAME = 1e-4
BOXES, HULLS, CONES = (1e-4, 1e-3), (1e-3, 2e-2), (1e-3, 1e-2)
VELOCITY = torch.zeros(STATE.width, dtype=torch.bool)
for _name in ("root_linear_velocity", "root_angular_velocity", "joint_velocity"):
    VELOCITY[STATE.slice(_name)] = True


def world_of(task: str) -> WorldConfig:
    initial = InitialStates(reference=0.6, near=0.4, far=0.0)
    return WorldConfig(task=task, pieces=4, scales=1, initial=initial, carry=CarryConfig(sizes=4))


def bank_of(world: WorldConfig) -> ObjectBank:
    """Boxes and, of furniture, the same pieces as hulls."""
    if world.task == "carry":
        return BoxBank(boxes(world.carry))
    if world.task == "walk":
        return FloorBank()
    kind = None if world.task == "sit" else world.task
    found = variants(catalogue("train", world.pieces, affordance=kind), 1, world.scale)
    return FurnitureBank([*found, *map(hulled, found)], world.task)


class Pair:
    """The same shard on both simulators; what cannot be done to it twice is done to a copy."""

    def __init__(self, task: str) -> None:
        if task == "track":
            self.world, self.library, self.bank = (
                track_scenes.WORLD,
                track_scenes.motions(),
                track_scenes.bank(),
            )
        else:
            self.world = world_of(task)
            self.library = load.library((), True, tasks.make(task).affordance.clips)
            self.bank = bank_of(self.world)
        self.ours = Shard(self.world, self.library, self.bank, SCENES, 3)
        self.theirs = Shard(self.world, self.library, self.bank, SCENES, 3, simulator="warp")

    def hulls(self) -> Tensor:
        """[n] bool: scenes with a piece of hulls."""
        return torch.tensor([bool(self.bank.pieces[v].hulls) for v in self.ours._variant.tolist()])


class Pairs(dict[str, Pair]):
    """A pair of each task, made when it is wanted."""

    def __missing__(self, task: str) -> Pair:
        self[task] = Pair(task)
        return self[task]


@pytest.fixture(scope="module")
def pairs() -> dict[str, Pair]:
    return Pairs()


def actions(clock: int) -> Tensor:
    return 0.2 * random_streams.normal(7, torch.tensor(SCENES), clock, NU)


def gaps(pair: Pair) -> Tensor:
    """[n]: of positions, the largest difference, m or rad."""
    ours, theirs = pair.ours._scenes, pair.theirs._scenes
    apart = [(ours.qpos - theirs.qpos), (ours.free_qpos - theirs.free_qpos)]
    return torch.cat(apart, dim=1).abs().amax(1)


def touching(scenes: Scenes) -> Tensor:
    """[n] bool: scenes with a contact now, by C's own collision detection."""
    found = []
    for i, model in enumerate(scenes.models):
        data = mujoco.MjData(model)
        for name in ("qpos", "mocap_pos", "mocap_quat"):
            getattr(data, name)[:] = scenes._array[name][i]
        mujoco.mj_forward(model, data)
        found.append(data.ncon > 0)
    return torch.tensor(found)


def require_equal_readings(pair: Pair) -> None:
    """Of one state, theirs: features, goals, rewards and terminations on both to SAME."""
    ours, theirs = pair.ours, pair.theirs
    ours._scenes.load_physics(theirs._scenes.physics())
    read = []
    for shard in (ours, theirs):
        body, target, task = shard._scenes.body(), shard._target(), shard.task
        read.append(
            (
                tasks.state(body, target),
                task.goal_features(body, target),
                task.reward_terms(body, target),
                task.error_m(body, target),
                task.fell(body, target).float(),
                task.stage(body, target).float(),
            )
        )
    for one, other in zip(*read, strict=True):
        torch.testing.assert_close(one, other, atol=SAME, rtol=0.0)


@pytest.mark.parametrize("task", TASKS)
def test_thirty_control_steps_from_the_same_states(task: str, pairs: dict[str, Pair]) -> None:
    pair = pairs[task]
    ours, theirs = pair.ours, pair.theirs
    assert torch.equal(ours._variant, theirs._variant)
    kinds = {False: CONES if task in BOXED else BOXES, True: HULLS}
    seen, some = {"free": 0, "contact": 0}, task not in ("sit", "lie")
    for clock in range(STEPS):
        theirs._scenes.load_physics(ours._scenes.physics())
        met, hulls = touching(ours._scenes), pair.hulls()
        some |= bool(hulls.any())
        one, other = ours.step(actions(clock)), theirs.step(actions(clock))
        met |= touching(ours._scenes)
        for name in ("end_ids", "fell", "timed_out", "finite"):
            assert torch.equal(getattr(one, name), getattr(other, name)), f"{clock}: {name}"
        gap = gaps(pair)
        assert (gap[~met] < 1e-5).all(), f"step {clock}, free: {gap}"
        assert (gap < 1e-3).all(), f"step {clock}, in contact: {gap}"
        assert torch.allclose(one.reward, other.reward, atol=1e-4), f"step {clock}"
        # one of track's is of joint velocities, which contacts change
        terms = 5e-4 if task == "track" else 1e-4
        assert torch.allclose(one.terms, other.terms, atol=terms), f"step {clock}"
        apart = (ours.observe()[0] - theirs.observe()[0]).abs()
        for kind, (slow, fast) in kinds.items():
            rows = apart[hulls if kind else ~hulls]
            assert (rows[:, ~VELOCITY] < slow).all(), f"step {clock}"
            assert (rows[:, VELOCITY] < fast).all(), f"step {clock}"
        moves = box_moves(ours)
        apart = (ours.observe()[1] - theirs.observe()[1]).abs()
        assert (apart[:, ~moves] < 1e-3).all(), f"step {clock}"
        assert (apart[:, moves] < CONES[1]).all(), f"step {clock}"
        require_equal_readings(pair)
        seen["free"] += int((~met).sum())
        seen["contact"] += int(met.sum())
    assert some and seen["contact"] > 20 and (seen["free"] > 5 or task in BOXED), seen


def box_moves(shard: Shard) -> torch.Tensor:
    """[G] bool: features of the goal that are velocities of a box."""
    found = torch.zeros(shard.task.goal.width, dtype=torch.bool)
    for feature in shard.task.goal:
        found[shard.task.goal.slice(feature.name)] = feature.unit in ("m/s", "rad/s")
    return found


@pytest.mark.parametrize("task", ["sit", "lie"])
def test_thirty_control_steps_on_end(task: str, pairs: dict[str, Pair]) -> None:
    pair = pairs[task]
    pair.theirs.load_state_dict(pair.ours.state_dict())
    going = ~pair.hulls()  # whose differences grow within so many steps
    for clock in range(STEPS):
        one, other = pair.ours.step(actions(clock)), pair.theirs.step(actions(clock))
        assert torch.equal(one.end_ids, other.end_ids)
        going[one.end_ids] = False
    assert going.any()
    assert (gaps(pair)[going] < 1e-3).all(), gaps(pair)


def test_a_state_goes_on_to_the_bit(pairs: dict[str, Pair]) -> None:
    shard = pairs["sit"].theirs
    before = shard.state_dict()
    first = [shard.step(actions(clock)).reward for clock in range(3)]
    after = shard.state_dict()
    shard.load_state_dict(before)
    again = [shard.step(actions(clock)).reward for clock in range(3)]
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True))
    assert all(torch.equal(value, shard.state_dict()[name]) for name, value in after.items())


def test_arrays_are_shared_without_a_copy(pairs: dict[str, Pair]) -> None:
    scenes = pairs["sit"].theirs._scenes
    for name in ("qpos", "qvel", "ctrl", "mocap_pos"):
        assert scenes._array[name].data_ptr() == getattr(scenes._data, name).ptr
    for name, field in scenes._fields.items():
        assert field.data_ptr() == getattr(scenes._model, name).ptr
        assert field.shape[0] == len(SCENES)


def test_a_world_without_a_hull_in_a_slot_has_data_id_minus_1(pairs: dict[str, Pair]) -> None:
    pair = pairs["sit"]
    scenes, pieces = pair.theirs._scenes, pair.bank.pieces
    slots = [g for g in range(scenes.template.ngeom) if "hull" in scenes.template.geom(g).name]
    scenes.choose(torch.arange(2), pair.bank, torch.tensor([0, len(pieces) - 1]))
    used = (scenes._fields["geom_dataid"][:2, slots] >= 0).sum(1).tolist()
    scenes.choose(torch.arange(6), pair.bank, pair.theirs._variant)
    assert used == [0, len(pieces[-1].hulls)]
    boxes_only = replace(pieces[0], boxes=pieces[0].boxes)
    object.__setattr__(boxes_only, "boxes", pieces[0].boxes * 9)
    with pytest.raises(PieceError, match="slots for 16 hulls or 8 boxes"):
        template(pair.bank.models[:1], [boxes_only])


@pytest.mark.parametrize(
    ("room", "named"),
    [(WarpConfig(48, 4), "--warp.njmax, which is 4"), (WarpConfig(1, 96), "nconmax")],
)
def test_contacts_without_room_stop_the_run_and_name_what_to_raise(
    room: WarpConfig, named: str, pairs: dict[str, Pair]
) -> None:
    pair = pairs["sit"]
    scenes = WarpScenes(pair.bank, len(SCENES), 0.35, 3.0, config=room)
    scenes.choose(torch.arange(len(SCENES)), pair.bank, pair.theirs._variant)
    state = pair.theirs._scenes.physics()
    state["qpos"][:, 2] -= 0.02  # everyone on, and in, the floor or the seat
    with pytest.raises(OverflowError, match=named):
        for _ in range(9):
            scenes.load_physics(state)
            scenes.act(torch.zeros(len(SCENES), NU))


@pytest.mark.parametrize("task", BOXED)
def test_whatever_differs_between_the_models_differs_between_the_worlds(
    task: str, pairs: dict[str, Pair]
) -> None:
    """Of the character and the box; the furniture has slots of its own."""
    bank = pairs[task].bank
    made = template(bank.models, bank.pieces)
    cargo = made.model.geom(BOX_BODY).id
    differing = set()
    read = pairs[task].theirs._scenes._model
    for name in dir(bank.models[0]):
        kinds = ("geom_", "body_", "dof_", "jnt_", "actuator_", "pair_")
        if not name.startswith(kinds) or not hasattr(read, name) or name in SLEEP:
            continue  # mujoco-warp does not read it
        values = [np.asarray(getattr(model, name)) for model in bank.models]
        if name.startswith("geom_") and len(values[0]) == bank.models[0].ngeom:
            values = [
                value[model.geom(BOX_BODY).id]
                for value, model in zip(values, bank.models, strict=True)
            ]
        elif name.endswith(("adr", "num")):
            continue  # of the furniture's geoms
        if any(not np.array_equal(value, values[0]) for value in values):
            differing.add(name)
            held = made.tables.get(name)
            assert held is not None, f"{name} differs between the models"
            rows = held[:, cargo] if name.startswith("geom_") else held
            assert all(np.array_equal(r, v) for r, v in zip(rows, values, strict=True)), name
    assert {"geom_size", "body_mass", "body_inertia"} <= differing
    assert ("geom_friction" in differing) == (task == "track")


def test_memory_grows_by_the_scene_and_what_does_not_fit_is_refused(pairs: dict[str, Pair]) -> None:
    scenes = pairs["sit"].theirs._scenes
    each = bytes_per_scene(scenes.template, scenes.config)
    assert 20e3 < each < 1e6
    more = bytes_per_scene(scenes.template, WarpConfig(96, 384))
    assert more > 1.5 * each
    require_memory(64, 64, each, int(64 * each))
    with pytest.raises(DeviceError, match="at most 128 fit: --scenes 128"):
        require_memory(256, 64, each, int(150 * each))
    with pytest.raises(DeviceError, match="not even a block of 64"):
        require_memory(256, 64, each, int(10 * each))


def test_set_points_stay_within_half_a_turn_of_the_joints() -> None:
    """C wraps a ball joint's error at pi, mujoco-warp does not: it must never come to that."""
    models = [compile_scene(None)] * 64
    scenes = Scenes(models, 0.35, 3.0)
    every = torch.arange(64)
    qpos = torch.from_numpy(standing_qpos()).expand(64, -1)
    scenes.set_state(every, qpos, torch.zeros(64, 34), torch.zeros(64, 3), torch.tensor([[1.0, 0]]))
    worst = 0.0
    for clock in range(240):
        scenes.aim(2.0 * random_streams.normal(1, every, clock, NU))
        error = scenes._ctrl - servos.coordinates(scenes.qpos)
        worst = max(worst, float(error.abs().max()))
        scenes.batch.step(nstep=4)
    assert 0.2 < worst < torch.pi


def test_a_shard_lives_on_another_device(
    pairs: dict[str, Pair], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All that a step and a reset make is where the scenes are: no tensor of the CPU in between."""
    pair = pairs["sit"]
    world = replace(pair.world, episode_s=0.5)
    wanted = Shard(world, pair.library, pair.bank, SCENES, 4, simulator="warp")

    def there(*arguments: object) -> WarpScenes:
        made = WarpScenes(pair.bank, len(SCENES), 0.35, 3.0)
        for name in ("_array", "_fields", "_tables"):
            held = getattr(made, name)
            setattr(made, name, {key: There(value) for key, value in held.items()})
        made.device = GPU
        monkeypatch.setattr(made, "_warp_device", lambda: wp.ScopedDevice("cpu"))
        qpos, qvel = made._array["qpos"], made._array["qvel"]
        made._qpos, made._qvel = qpos[:, :43], qvel[:, :34]
        made.free_qpos, made.free_qvel = qpos[:, 43:], qvel[:, 34:]
        made._ctrl, made._overflow = made._array["ctrl"], There(made._overflow)
        made._map = moved(made._map, GPU)
        return made

    with stand_in_gpu() as gpu:
        monkeypatch.setattr(simulators, "make", there)
        found = Shard(world, pair.library, pair.bank, SCENES, 4, simulator="warp", device=gpu)
        ends = 0
        for clock in range(20):
            one, other = wanted.step(actions(clock)), found.step(actions(clock).to(gpu))
            ends += len(one.end_ids)
            assert isinstance(other.reward, There)
            assert torch.equal(one.reward, other.reward.cpu())
            assert torch.equal(one.end_states, other.end_states.cpu())
            for mine, yours in zip(wanted.observe(), found.observe(), strict=True):
                assert torch.equal(mine, yours.cpu())
        state = {name: value.cpu() for name, value in found.state_dict().items()}
        found.load_state_dict(state)
    assert ends > 0
