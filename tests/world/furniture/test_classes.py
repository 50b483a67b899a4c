"""The seven classes: sofas, beds and tables, what they afford, and that they stay as they were."""

import hashlib
import math

import numpy as np
import pytest

from world.errors import ChoiceError, PieceError
from world.furniture import bed, sofa, table
from world.furniture.bands import cells
from world.furniture.catalogue import REGISTRY, SEATS, catalogue, find, whole
from world.furniture.piece import HIP_TO_HEAD_M, SLOTS, Piece, rotation
from world.furniture.surface import triangles
from world.furniture.usage import SIT

LARGE = [p for split in ("train", "test") for p in whole(split) if p.category not in SEATS]

GENERATORS = {
    "sofa": (sofa.dimensions, sofa.RANGES),
    "bed": (bed.dimensions, bed.RANGES),
}


def inside(piece: Piece, point: tuple[float, float, float]) -> bool:
    """Whether a point lies in one of the piece's boxes."""
    for box in piece.boxes:
        local = rotation(box.quat).T @ (np.array(point) - box.centre_m)
        if (np.abs(local) <= box.half_m).all():
            return True
    return False


def on_top(piece: Piece, point: tuple[float, float, float], by_m: float = 0.012) -> bool:
    """Whether the surface runs through the point: solid just below it, free just above."""
    x, y, z = point
    return inside(piece, (x, y, z - by_m)) and not inside(piece, (x, y, z + by_m))


def test_the_pieces_that_policies_were_trained_on_stay_as_they_were() -> None:
    pieces = catalogue("train", 60) + catalogue("test", 12)
    text = repr([(p.name, p.boxes, p.sit, p.mass_kg) for p in pieces])
    # as it read before places said at which scales somebody rests on them
    text = text.replace(", rests_at=None", "")
    assert hashlib.sha256(text.encode()).hexdigest().startswith("062de67c4c6af10728f80")


def test_the_whole_catalogue() -> None:
    train, test = whole("train"), whole("test")
    assert (len(train), len(test)) == (350, 60)
    assert {p.category for p in train} == {p.category for p in test} == set(REGISTRY)
    assert all(sum(p.category == name for p in train) == 50 for name in REGISTRY)
    assert len({p.name for p in train + test}) == 410
    assert max(len(p.boxes) for p in train + test) <= SLOTS
    assert train[:7] == whole("train")[:7]
    assert find("sofa-train-003") in train


def test_affordances_choose_classes() -> None:
    seats, places = (
        catalogue("train", 20, affordance="sit"),
        catalogue("test", 10, affordance="lie"),
    )
    assert {p.category for p in seats} == set(SIT.classes)
    assert all(p.sit for p in seats)
    assert [p.category for p in places[:4]] == ["sofa", "bed", "table", "sofa"]
    assert all(p.lie is not None for p in places)
    # the third table is not the third of its class, but the third that is long enough
    assert [p for p in places if p.category == "table"] == [
        p for i in range(61) if (p := find(f"table-test-{i:03d}")).lie is not None
    ][:3]
    with pytest.raises(PieceError, match="no table has a place to sit"):
        catalogue("train", 1, classes=("table",), affordance="sit")
    with pytest.raises(ChoiceError, match="choose one of lie, sit"):
        catalogue("train", 4, affordance="stand")  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("piece", LARGE[::3], ids=lambda p: p.name)
def test_places_are_on_the_surface(piece: Piece) -> None:
    low, high = piece.bounds()
    assert np.allclose(low[:2], -high[:2], atol=1e-9)
    assert abs(low[2]) < 1e-9
    if piece.category == "table":
        assert not piece.sit
        long = piece.size_m[1] >= table.LONG_M and piece.size_m[0] >= table.DEEP_M
        assert (piece.lie is not None) == long
        if not long:
            return
    for place in piece.sit:
        assert on_top(piece, place.point_m)
    assert piece.lie is not None
    hip, head = np.array(piece.lie.hip_m), np.array(piece.lie.head_m)
    assert on_top(piece, piece.lie.hip_m)
    assert on_top(piece, piece.lie.head_m)
    assert np.linalg.norm((head - hip)[:2]) == pytest.approx(HIP_TO_HEAD_M)
    # the crown of the head, 0.1 m on, is still over the piece
    crown = head + 0.10 * (head - hip) / np.linalg.norm(head - hip)
    assert (crown[:2] > low[:2]).all()
    assert (crown[:2] < high[:2]).all()


def test_a_bed_by_hand() -> None:
    plain = bed.Dimensions(
        height_m=0.5, length_m=2.0, width_m=0.9, boards="head", board_thickness_m=0.04
    )
    piece = bed.build(plain)
    # 2.00 of mattress behind 0.04 of board: the origin is 1.02 from the board's back
    assert piece.lie is not None
    assert np.allclose(piece.lie.head_m, (-1.02 + 0.04 + 0.25, 0.0, 0.5))
    assert np.allclose(piece.lie.hip_m, (-1.02 + 0.04 + 0.25 + 0.635, 0.0, 0.5))
    # one sits on either long edge, facing out, 0.18 from it
    assert [round(math.degrees(p.facing_rad)) for p in piece.sit] == [90, -90]
    assert np.allclose([p.point_m[1] for p in piece.sit], [0.27, -0.27])


def test_a_long_table_by_hand() -> None:
    piece = table.build(table.Dimensions(height_m=0.74, depth_m=0.80, width_m=1.80))
    # the head 0.25 from the end of a top 1.80 long, whose middle is the origin
    assert piece.lie is not None
    assert np.allclose(piece.lie.head_m, (0.0, 0.65, 0.74))
    assert np.allclose(piece.lie.hip_m, (0.0, 0.65 - 0.635, 0.74))
    assert table.build(table.Dimensions(width_m=1.5)).lie is None
    assert table.build(table.Dimensions(width_m=1.8, depth_m=0.65)).lie is None


def test_a_wide_bed_is_for_two() -> None:
    piece = bed.build(bed.Dimensions(width_m=1.6))
    assert piece.lie is not None
    assert piece.lie.hip_m[1] == pytest.approx(0.8 - 0.45)


def test_sofas_have_a_place_for_everyone() -> None:
    assert len(sofa.build(sofa.Dimensions(clear_width_m=1.9)).sit) == 3
    assert len(sofa.build(sofa.Dimensions(clear_width_m=1.5)).sit) == 2
    corner = sofa.build(sofa.Dimensions(clear_width_m=1.9, arms="corner", base="plinth"))
    # no one sits where the chaise is in front of the knees
    assert all(p.point_m[1] > -0.95 + 0.68 for p in corner.sit)
    assert corner.size_m[0] > sofa.build(sofa.Dimensions()).size_m[0] + 0.5


def test_lying_down_does_not_grow_with_the_bed() -> None:
    piece = find("bed-train-002")
    assert piece.lie is not None
    for scale in (0.8, 1.2):
        other = piece.scaled(scale).lie
        assert other is not None
        assert np.allclose(other.head_m, scale * np.array(piece.lie.head_m))
        assert math.dist(other.hip_m[:2], other.head_m[:2]) == pytest.approx(HIP_TO_HEAD_M)
        assert other.hip_m[2] == pytest.approx(scale * piece.lie.hip_m[2])


@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize("split", ["train", "test"])
def test_drawn_dimensions_stay_in_their_split(name: str, split) -> None:
    dimensions, ranges = GENERATORS[name]
    for seed in range(30):
        drawn = dimensions(np.random.default_rng(seed), split)
        for field, span in ranges.items():
            value = getattr(drawn, field)
            assert any(low <= value <= high for low, high in cells(span, split)), field


@pytest.mark.parametrize("module", [sofa, bed, table])
def test_test_pieces_have_constructions_never_trained_on(module) -> None:
    assert set(module.STYLES["test"]) - set(module.STYLES["train"])


def test_unknown_styles_name_the_choices() -> None:
    with pytest.raises(ChoiceError, match="corner"):
        sofa.build(sofa.Dimensions(arms="wings"))
    with pytest.raises(ChoiceError, match="plinth"):
        bed.build(bed.Dimensions(base="ropes"))
    with pytest.raises(ChoiceError, match="head"):
        bed.build(bed.Dimensions(boards="some"))


def test_triangles_enclose_the_boxes() -> None:
    piece = find("table-train-000")
    corners = triangles(piece)
    assert corners.shape == (12 * len(piece.boxes), 3, 3)
    # the divergence theorem: outward faces give the boxes' volume
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume == pytest.approx(sum(8 * np.prod(b.half_m) for b in piece.boxes))
