"""One layout: boxes and hulls step in one batch, and scenes change their pieces without a
rebuild."""

import mujoco
import numpy as np
import pytest
import torch

from tests.support.hulls import hulled
from world.character.model import NU
from world.errors import PieceError
from world.furniture.catalogue import find
from world.objects import seated_pose
from world.objects.drop_test import drop
from world.objects.furniture_bank import FurnitureBank, variants
from world.scene import slots
from world.scene.batch import Scenes
from world.scene.model import compile_scene
from world.scene.slots import Layout

CHAIR, SOFA, STOOL = (find(f"{name}-train-000") for name in ("chair", "sofa", "low-stool"))
MIXED = (CHAIR, hulled(CHAIR), hulled(SOFA, 9), STOOL, hulled(STOOL, 4))


def test_plain_pieces_keep_the_plain_layout() -> None:
    assert slots.common([CHAIR, SOFA]) == Layout(8, 0)
    assert slots.fillings(CHAIR, Layout()) == []


@pytest.mark.parametrize("missing", range(44, 60))
def test_fillings_add_up_to_any_number_of_nodes(missing: int) -> None:
    faces = slots.fillings(CHAIR, Layout(8, missing))
    assert sum(2 * f - 1 for f in faces) == missing
    assert all(f % 2 == 0 and f >= 6 for f in faces)


def test_a_piece_beyond_the_layout_is_refused() -> None:
    with pytest.raises(PieceError, match="larger than the layout"):
        slots.fillings(hulled(CHAIR), Layout(8, 50))


def test_models_of_a_mixture_have_one_layout() -> None:
    shared = slots.common(MIXED)
    models = [compile_scene(piece, shared=shared) for piece in MIXED]
    assert len({m.nbvh for m in models}) == 1
    assert len({m.ngeom for m in models}) == 1
    # the simulator's own count of a hull's nodes is ours
    plain = compile_scene(CHAIR)
    own = compile_scene(MIXED[2], shared=slots.common([MIXED[2]]))
    assert own.nbvh - plain.nbvh == slots.common([MIXED[2]]).nodes


def test_a_mixture_steps_and_changes_its_pieces() -> None:
    bank = FurnitureBank(variants(MIXED, 2, (0.8, 1.2)))
    scenes = Scenes([bank.models[0]] * len(bank), 0.3, 3.0)
    scenes.set_models(range(len(bank)), bank.models)
    qpos = torch.from_numpy(np.stack([seated_pose.qpos(p.sit[0]) for p in bank.pieces]))
    ids = torch.arange(len(bank))
    upright = torch.tensor([[1.0, 0.0]]).expand(len(bank), 2)
    scenes.set_state(ids, qpos, torch.zeros(len(bank), 34), torch.zeros(len(bank), 3), upright)
    for _ in range(20):
        scenes.act(torch.zeros(len(bank), NU))
    assert bool(scenes.finite().all())
    before = scenes.physics()
    # the same furniture as boxes and as hulls carries the same character alike
    swapped = [bank.models[(i + 1) % len(bank)] for i in range(len(bank))]
    scenes.set_models(range(len(bank)), swapped)
    scenes.load_physics(before)
    scenes.act(torch.zeros(len(bank), NU))
    assert bool(scenes.qpos.isfinite().all())


@pytest.mark.parametrize("piece", [CHAIR, STOOL], ids=lambda p: p.name)
def test_hulls_of_boxes_carry_as_the_boxes_do(piece) -> None:
    boxes, hulls = drop(piece, 1.5), drop(hulled(piece), 1.5)
    assert hulls.height_error_m == pytest.approx(boxes.height_error_m, abs=1e-3)
    assert hulls.off_m == pytest.approx(boxes.off_m, abs=5e-3)
    assert hulls.deepest_m < 0.005


def test_hulls_scale_and_move_with_their_piece() -> None:
    piece = hulled(SOFA)
    large = piece.scaled(1.2)
    assert np.allclose(large.size_m, 1.2 * np.array(piece.size_m))
    assert np.allclose(large.boxes[0].half_m, 1.2 * np.array(piece.boxes[0].half_m))
    assert np.allclose(piece.corners(), SOFA.corners(), atol=1e-3)


def test_unused_slots_touch_nothing() -> None:
    shared = slots.common(MIXED)
    model = compile_scene(STOOL, shared=shared)
    data = mujoco.MjData(model)
    # the parked slots lie at the furniture's origin, under a character that lies there
    data.qpos[2] = 0.10
    mujoco.mj_forward(model, data)
    names = {model.geom(int(g)).name for c in data.contact[: data.ncon] for g in c.geom}
    used = {f"slot{i}" for i in range(len(STOOL.boxes))}
    assert not {n for n in names if n.startswith("slot")} - used
