"""Furniture: its frame, its parts, its catalogue, and that train and test never meet."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest

from world.errors import ChoiceError, PieceError
from world.furniture import armchair, chair, stool
from world.furniture import seat as seats
from world.furniture.bands import cells, draw
from world.furniture.catalogue import SEATS, catalogue, find
from world.furniture.piece import SLOTS, Box, Piece, Place, rotation

PIECES = catalogue("train") + catalogue("test")

GENERATORS = {
    "chair": (chair.dimensions, chair.RANGES),
    "armchair": (armchair.dimensions, armchair.RANGES),
    "low-stool": (stool.low_dimensions, stool.LOW),
    "high-stool": (stool.high_dimensions, stool.HIGH),
}


def top_below(piece: Piece, x: float, y: float) -> float:
    """Highest point of the piece on the vertical line through x, y; -inf where there is none."""
    best = -math.inf
    for box in piece.boxes:
        turn = rotation(box.quat)
        # In the box's axes, the ray from 10 m up: start + s * direction, clipped by three slabs.
        start = turn.T @ (np.array([x, y, 10.0]) - box.centre_m)
        direction = turn.T @ np.array([0.0, 0.0, -1.0])
        enter, leave = 0.0, math.inf
        for a in range(3):
            if abs(direction[a]) < 1e-12:
                if abs(start[a]) > box.half_m[a]:
                    leave = -math.inf
                continue
            ends = sorted((s * box.half_m[a] - start[a]) / direction[a] for s in (-1, 1))
            enter, leave = max(enter, ends[0]), min(leave, ends[1])
        if enter <= leave:
            best = max(best, 10.0 - enter)
    return best


def test_catalogue_is_balanced_and_named():
    train, test = catalogue("train"), catalogue("test")
    assert (len(train), len(test)) == (60, 12)
    for name in SEATS:
        assert sum(p.category == name for p in train) == 15
        assert sum(p.category == name for p in test) == 3
    assert len({p.name for p in PIECES}) == 72
    assert train[4].name == "chair-train-001"


def test_catalogue_is_deterministic_and_extends():
    assert catalogue("train", 9) == catalogue("train")[:9]
    assert catalogue("train", 8, seed=1) != catalogue("train", 8)
    assert catalogue("test", 2, seed=3)[1] == find("armchair-test-000", seed=3)
    assert find("low-stool-train-007") == catalogue("train")[4 * 7 + 2]
    only = catalogue("train", 3, classes=("high-stool",))
    assert [p.name for p in only] == [f"high-stool-train-00{i}" for i in range(3)]


@pytest.mark.parametrize("name", ["throne-train-000", "chair-both-000"])
def test_unknown_class_or_split_names_the_choices(name: str):
    with pytest.raises(ChoiceError, match=r"low-stool|train"):
        find(name)


def test_a_malformed_name_says_how_names_look():
    with pytest.raises(PieceError, match="chair-train-007"):
        find("chair")


def test_unknown_styles_name_the_choices():
    with pytest.raises(ChoiceError, match="cantilever"):
        chair.build(chair.Dimensions(base="wheels"))
    with pytest.raises(ChoiceError, match="splat"):
        chair.build(chair.Dimensions(back="none"))
    with pytest.raises(ChoiceError, match="swivel"):
        armchair.build(armchair.Dimensions(style="rocking"))
    with pytest.raises(ChoiceError, match="braced"):
        stool.build(stool.Dimensions(base="wheels"))
    with pytest.raises(ChoiceError, match="furniture class 'throne'"):
        catalogue("train", 4, classes=("throne",))


def test_cells_by_hand():
    # (0, 5): cells of 1, a tenth left out at each end, dealt train, test, train, test, train.
    assert np.allclose(cells((0.0, 5.0), "train"), [(0.1, 0.9), (2.1, 2.9), (4.1, 4.9)])
    assert np.allclose(cells((0.0, 5.0), "test"), [(1.1, 1.9), (3.1, 3.9)])
    spans = sorted(cells((0.38, 0.48), "train") + cells((0.38, 0.48), "test"))
    assert all(a[1] < b[0] for a, b in pairwise(spans))


def test_pieces_of_both_splits_differ_in_seat_height():
    for name in SEATS:
        heights = {
            split: [
                round(GENERATORS[name][0](np.random.default_rng(i), split).seat_height_m, 6)
                for i in range(200)
            ]
            for split in ("train", "test")
        }
        gap = min(abs(a - b) for a in heights["train"] for b in heights["test"])
        # A fifth of a cell lies between neighbouring cells: at least 0.2 * 0.02 m.
        assert gap >= 0.2 * 0.02 - 1e-6


@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("split", ["train", "test"])
def test_every_drawn_dimension_stays_in_its_split(name: str, split):
    dimensions, ranges = GENERATORS[name]
    for seed in range(40):
        drawn = dataclasses.asdict(dimensions(np.random.default_rng(seed), split))
        for field, span in ranges.items():
            assert any(low <= drawn[field] <= high for low, high in cells(span, split)), field


def test_test_pieces_have_constructions_never_trained_on():
    assert not {b for b, _ in chair.STYLES["train"]} >= {b for b, _ in chair.STYLES["test"]}
    for styles in (armchair.STYLES, stool.LOW_BASES, stool.HIGH_BASES):
        assert set(styles["test"]) - set(styles["train"])


def test_a_few_pieces_show_every_construction():
    rng = np.random.default_rng(0)
    assert [chair.dimensions(rng, "test", i).base for i in range(6)] == [
        "legs",
        "cantilever",
        "cantilever",
        "panels",
        "sled",
        "legs",
    ]
    shown = {armchair.dimensions(rng, "test", i).style for i in range(3)}
    assert shown == {"open", "club", "swivel"}
    assert {stool.low_dimensions(rng, "train").base for _ in range(200)} == set(
        stool.LOW_BASES["train"]
    )


def test_draws_cover_every_cell():
    rng = np.random.default_rng(0)
    values = np.array([draw(rng, "train", {"a": (0.0, 5.0)})["a"] for _ in range(300)])
    assert set(values.astype(int)) == {0, 2, 4}


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_frame_slots_and_size(piece: Piece):
    low, high = piece.bounds()
    assert np.allclose(low[:2], -high[:2], atol=1e-12)
    assert abs(low[2]) < 1e-12
    assert 1 <= len(piece.boxes) <= SLOTS
    assert 0.29 < piece.size_m[0] < 1.0
    assert 0.31 < piece.size_m[1] < 0.95
    assert piece.mass_kg >= 3.0
    corners = piece.corners()
    assert corners.shape == (8, 3)
    assert np.array_equal(corners[0], low)
    assert np.allclose(corners[1], [low[0], low[1], high[2]])
    assert np.allclose(corners[7], high)


@pytest.mark.parametrize("piece", PIECES, ids=lambda p: p.name)
def test_the_place_is_the_seat_with_support_around(piece: Piece):
    (place,) = piece.sit
    x, y, z = place.point_m
    assert place.facing_rad == 0.0
    assert abs(top_below(piece, x, y) - z) < 1e-6
    # A pelvis is about 0.3 m wide and 0.2 m deep; half as much in front still carries the thighs.
    for dx in (-0.10, 0.0, 0.13):
        for dy in (-0.12, 0.12):
            assert abs(top_below(piece, x + dx, y + dy) - z) < 0.015
    heights = {
        "chair": (0.36, 0.48),
        "armchair": (0.33, 0.46),
        "low-stool": (0.30, 0.45),
        "high-stool": (0.50, 0.68),
    }
    low, high = heights[piece.category]
    assert low <= z <= high


@pytest.mark.parametrize(
    "piece", [p for p in PIECES if "chair" in p.category], ids=lambda p: p.name
)
def test_the_back_is_behind_the_place(piece: Piece):
    x, _, z = piece.sit[0].point_m
    # March backwards until the surface is well above the seat: that is the back, leaning away.
    steps = np.arange(0.0, 0.45, 0.001)
    risen = next(s for s in steps if top_below(piece, x - s, 0.0) > z + 0.1)
    assert 0.159 <= risen <= 0.20 + 0.1 * math.tan(math.radians(15)) + 0.003
    front = next(s for s in steps if top_below(piece, x + s, 0.0) < z - 0.02)
    assert 0.38 <= risen + front <= 0.54


@pytest.mark.parametrize(
    "piece", [p for p in PIECES if p.category == "armchair"], ids=lambda p: p.name
)
def test_arms_are_beside_the_place(piece: Piece):
    x, _, z = piece.sit[0].point_m
    for side in (-1, 1):
        gap = next(g for g in np.arange(0.0, 0.4, 0.001) if top_below(piece, x, side * g) > z + 0.1)
        assert 0.24 <= gap <= 0.302
        assert 0.18 <= top_below(piece, x, side * (gap + 0.01)) - z <= 0.26


def test_a_chair_by_hand():
    plain = chair.Dimensions(
        seat_height_m=0.4,
        seat_depth_m=0.4,
        seat_width_m=0.5,
        seat_tilt_deg=0.0,
        back_height_m=0.5,
        back_thickness_m=0.04,
        recline_deg=0.0,
        pelvis_from_back_m=0.18,
    )
    piece = chair.build(plain)
    # Depth 0.40 + 0.04 behind; the origin is 0.22 from the front edge, 0.18 from the back's face.
    assert np.allclose(piece.size_m, (0.44, 0.5, 0.9))
    assert np.allclose(piece.sit[0].point_m, (0.0, 0.0, 0.4))
    assert len(piece.boxes) == 6


def test_tilt_lowers_the_seat_towards_the_back():
    seat = seats.Seat(0.45, 0.40, 0.45, 0.04, tilt_rad=math.radians(4.0))
    assert seat.surface_m(0.40) == pytest.approx(0.45)
    assert seat.surface_m(0.0) == pytest.approx(0.45 - 0.4 * math.tan(math.radians(4.0)))
    piece = Piece("seat", "seat", (seat.box(),), (), 1.0)
    for x in (0.01, 0.2, 0.39):
        assert top_below(piece, x, 0.1) == pytest.approx(seat.surface_m(x), abs=1e-9)


def test_recline_leans_the_back_away():
    seat = seats.Seat(0.45, 0.40, 0.45, 0.04)
    back = seats.backrest(seat, 0.0, 0.5, 0.4, 0.03, math.radians(15.0))
    turn = rotation(back.quat)
    front = np.array(back.centre_m) + turn @ np.array([0.015, 0.0, -0.25])
    crown = np.array(back.centre_m) + turn @ np.array([0.015, 0.0, 0.25])
    assert np.allclose(front, [0.0, 0.0, 0.45])
    assert np.allclose(
        crown - front, 0.5 * np.array([-math.sin(0.2618), 0, math.cos(0.2618)]), atol=1e-5
    )


def test_scaling():
    piece = find("armchair-train-003")
    small = piece.scaled(0.8)
    assert np.allclose(small.size_m, 0.8 * np.array(piece.size_m))
    assert np.allclose(small.sit[0].point_m, 0.8 * np.array(piece.sit[0].point_m))
    assert np.allclose(small.corners(), 0.8 * piece.corners())
    assert small.mass_kg == pytest.approx(0.512 * piece.mass_kg)
    assert small.sit[0].facing_rad == piece.sit[0].facing_rad
    assert [b.quat for b in small.boxes] == [b.quat for b in piece.boxes]
    for bad in (0.0, -1.0, math.nan):
        with pytest.raises(PieceError, match="above 0"):
            piece.scaled(bad)


def test_padding_keeps_the_boxes_and_marks_the_rest():
    piece = find("high-stool-train-000")
    centre, half, quat, used = piece.boxes_padded()
    count = len(piece.boxes)
    assert centre.shape == half.shape == (SLOTS, 3)
    assert quat.shape == (SLOTS, 4)
    assert used.tolist() == [True] * count + [False] * (SLOTS - count)
    assert np.allclose(centre[:count], [b.centre_m for b in piece.boxes])
    assert np.all(half > 0.0)
    assert np.allclose(np.linalg.norm(quat, axis=1), 1.0)
    assert max(len(p.boxes) for p in PIECES) == SLOTS


def test_pieces_that_cannot_be_are_refused():
    box = Box((0.0, 0.0, 0.5), (0.5, 0.5, 0.5))
    with pytest.raises(PieceError, match="9 boxes"):
        Piece("x", "chair", (box,) * 9, (Place((0.0, 0.0, 1.0)),), 1.0)
    with pytest.raises(PieceError, match="0 boxes"):
        Piece("x", "chair", (), (), 1.0)
    with pytest.raises(PieceError, match="volume"):
        Piece("x", "chair", (Box((0.0, 0.0, 0.0), (0.1, 0.0, 0.1)),), (), 1.0)
