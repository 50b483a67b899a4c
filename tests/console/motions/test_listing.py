"""`inhabit motions list`: what is said of a clip that sits, lies, carries or only walks."""

import json

import numpy as np
import pytest

from console.commands import MotionsList
from console.motions import listing
from world.motions import load
from world.motions.clip import Clip


def test_each_kind_of_clip_lists_its_objects() -> None:
    kinds: dict[str | None, Clip] = {}
    for clip in load.own_clips():
        kind = "box" if clip.box else "bed" if clip.bed else "seat" if clip.seat else None
        kinds.setdefault(kind, clip)
    rows = {kind: listing.listed(clip) for kind, clip in kinds.items()}
    assert {row["uses"] for row in rows.values()} == {None, "seat", "bed", "box"}
    walks, sits, carries = rows[None], rows["seat"], rows["box"]
    assert walks["from_s"] is None and walks["seat_height_m"] is None
    seat = kinds["seat"].seat
    assert sits["seat_height_m"] == pytest.approx(seat.point_m[2], abs=1e-3)
    assert sits["from_s"] == pytest.approx(seat.from_frame / kinds["seat"].fps, abs=0.01)
    held = np.flatnonzero(kinds["box"].box.held)
    assert carries["from_s"] == pytest.approx(held[0] / 30, abs=0.01)
    assert len(carries["box_size_m"]) == 3 and rows["bed"]["bed_height_m"] > 0.2


def test_the_list_is_json_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    assert listing.motions_command(MotionsList(json=True)) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["clip"] for row in rows] == [clip.name for clip in load.own_clips()]
    assert listing.motions_command(MotionsList()) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.startswith(f"{len(rows)} clips") and "carry" in last and "neither" in last
