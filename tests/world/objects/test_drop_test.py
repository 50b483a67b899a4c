"""A seated ragdoll comes to rest on every seat at the height that the piece gives, at all sizes."""

import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from console.app import main
from world.character import model as character
from world.furniture.catalogue import find, whole
from world.furniture.piece import Box, Piece, Place
from world.objects import seated_pose
from world.objects.drop_test import drop

#: One of every construction or so; docs/results/furniture.md has the figures of all.
PIECES = [p for p in (*whole("train")[:49:2], *whole("test")[:28:3]) if p.sit]
CLASSES = ("chair", "armchair", "low-stool", "high-stool", "sofa", "bed")


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_a_ragdoll_comes_to_rest_on_the_seat(piece: Piece, scale: float) -> None:
    rest = drop(piece.scaled(scale), seconds=3.0)
    assert rest.finite
    assert abs(rest.height_error_m) < 0.03
    assert rest.deepest_m < 0.015
    assert rest.speed_m_s < 0.1
    assert rest.off_m < 0.25
    assert rest.rests


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("name", CLASSES)
def test_nothing_explodes_in_ten_seconds(name: str, scale: float) -> None:
    rest = drop(find(f"{name}-train-004").scaled(scale), seconds=10.0)
    assert rest.rests
    assert rest.fastest_m_s < 1.5


def test_a_place_that_is_wrong_is_told() -> None:
    """The oracle itself: too high, in the air, turned against the back, beside the seat."""
    slab = (Box((0.0, 0.0, 0.43), (0.25, 0.25, 0.02)), Box((-0.25, 0.0, 0.7), (0.02, 0.25, 0.3)))
    chair = Piece("chair", "chair", slab, (Place((0.0, 0.0, 0.45)),), 5.0)
    right = drop(chair)
    assert right.rests
    # it sinks in by the softness of the contact alone
    assert abs(right.height_error_m) < 0.005
    high = drop(replace(chair, sit=(Place((0.0, 0.0, 0.50)),)))
    assert not high.rests
    assert high.height_error_m == pytest.approx(-0.05, abs=0.01)
    assert not drop(replace(chair, sit=(Place((0.0, 0.0, 0.45), np.pi),))).rests
    assert not drop(replace(chair, sit=(Place((0.30, 0.0, 0.45)),))).rests


def test_seated_poses_are_in_the_joints_ranges_and_off_the_floor() -> None:
    model = mujoco.MjModel.from_xml_string(character.spec().to_xml())
    data = mujoco.MjData(model)
    low, high = character.target_bounds()
    for height in (0.2, 0.35, 0.45, 0.6, 0.8):
        for pose in seated_pose.poses():
            place = Place((0.0, 0.0, height))
            targets = seated_pose.targets(place, pose)
            assert (targets >= low - 1e-9).all()
            assert (targets <= high + 1e-9).all()
            data.qpos[:] = seated_pose.qpos(place, 0.0, pose)
            mujoco.mj_forward(model, data)
            thighs = [data.geom(f"{side}_thigh").xpos[2] for side in ("left", "right")]
            assert np.allclose(thighs, height + seated_pose.THIGH_M, atol=0.03)
            # soles 0.05 below the ankles
            feet = [data.body(f"{side}_foot").xpos[2] - 0.05 for side in ("left", "right")]
            assert min(feet) > -0.03


def test_the_command_drops(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from tests.console.training.test_objects import kept

    kept(tmp_path, find("chair-train-003"))
    kept(tmp_path, find("table-train-000"))
    words = ["objects", "check", str(tmp_path), "--drop", "1", "--threads", "1"]
    assert main([*words, "--json"]) == 0
    rows = {row["piece"]: row["drops"] for row in json.loads(capsys.readouterr().out)}
    assert rows["table-train-000"] == []
    assert [one["scale"] for one in rows["chair-train-003"]] == [0.8, 1.0, 1.2]
    assert all(one["finite"] for one in rows["chair-train-003"])
    assert main(words) == 0
    assert "of 3 drops came to rest on the seat, 0 blew up" in capsys.readouterr().out
    assert main(["objects", "check", str(tmp_path), "--drop", "-1"]) == 2
