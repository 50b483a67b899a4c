"""Places kept by letting a ragdoll down on them; what is said of those on which nobody stays."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from world.errors import PieceError
from world.furniture.affordance.relief import Relief, relief
from world.furniture.piece import TEST_SCALES, Box, Lying, Piece, SeatTarget
from world.furniture.surface import triangles
from world.meshes import resting, store
from world.meshes.build import Built
from world.objects import furniture_bank
from world.objects.drop_test import scales, slips_at

SLAB = (Box((0.0, 0.0, 0.43), (0.25, 0.35, 0.02)),)
BENCH = Piece("bench", "low-stool", SLAB, (SeatTarget((0.0, 0.0, 0.45)),), 5.0)


def solid(piece: Piece) -> Relief:
    return relief(triangles(piece))


def at(x: float, facing_rad: float = 0.0) -> SeatTarget:
    return SeatTarget((x, 0.0, 0.45), facing_rad)


def test_a_place_that_holds_stays_where_it_is() -> None:
    (place,) = resting.confirmed(BENCH, solid(BENCH)).sit
    assert place == replace(BENCH.sit[0], rests_at=TEST_SCALES)
    assert slips_at(place) == ()


def test_a_place_at_the_edge_is_moved_back_until_it_holds() -> None:
    """The pelvis 2 cm past the front edge: it falls off; up to 12 cm back it carries."""
    before = replace(BENCH, sit=(at(0.27),))
    assert resting.tested(before).sit[0].rests_at == ()
    (place,) = resting.confirmed(before, solid(BENCH)).sit
    assert place.rests_at == TEST_SCALES
    assert 0.27 - max(resting.MOVES_M) - 1e-9 <= place.point_m[0] < 0.27
    assert place.point_m[1:] == pytest.approx((0.0, 0.45), abs=0.005)


def test_of_several_places_those_that_hold_are_kept() -> None:
    beyond = at(0.45)
    both = replace(BENCH, sit=(beyond, at(0.0)))
    assert [p.point_m for p in resting.confirmed(both, solid(BENCH)).sit] == [(0.0, 0.0, 0.45)]


def test_where_nobody_stays_is_refused_but_for_tables_and_beds() -> None:
    nowhere = replace(BENCH, sit=(at(0.45),))
    found = resting.confirmed(nowhere, solid(BENCH))
    assert found.sit[0].rests_at == ()
    says = r"bench: a seated ragdoll slides or tips off .* --sit .*--force"
    lie = Lying((0.0, 0.0, 0.45), (0.0, 0.6, 0.45))
    for thrown in (found, replace(found, category="sofa", lie=lie)):
        with pytest.raises(PieceError, match=says):
            resting.required(thrown)
    bed = replace(found, category="bed", lie=lie)
    assert resting.required(bed) == replace(bed, sit=())
    assert resting.required(replace(found, category="table")).sit == ()
    assert resting.required(replace(found, sit=())).sit == ()


def test_where_the_ragdoll_sinks_below_the_seat_both_heights_are_kept() -> None:
    """A target 4 cm above the slab: the ragdoll rests on the slab, within its tolerance."""
    high = SeatTarget((0.0, 0.0, 0.49))
    (place,) = resting.confirmed(replace(BENCH, sit=(high,)), solid(BENCH)).sit
    assert place.rests_at == TEST_SCALES
    assert place.seat_m == 0.49
    assert 0.45 < place.point_m[2] < 0.49 and place.point_m[:2] == (0.0, 0.0)


def test_seats_that_a_scale_makes_too_high_are_not_tried() -> None:
    # 1.2 * 0.76 = 0.912 m
    assert scales(SeatTarget((0.0, 0.0, 0.76))) == (0.8, 1.0)
    assert scales(SeatTarget((0.0, 0.0, 0.74))) == TEST_SCALES


@pytest.mark.parametrize(
    ("rests_at", "scale", "expected"),
    [
        (None, 0.85, 0.85),  # not tried
        (TEST_SCALES, 0.85, 0.85),
        ((1.2,), 0.85, 1.2),
        ((1.2,), 1.15, 1.15),  # next to one at which it holds
        ((0.8, 1.0), 1.15, 1.0),
        ((), 0.85, 0.85),  # nothing better is known
    ],
)
def test_training_leaves_out_scales_at_which_nobody_stays(
    rests_at: tuple[float, ...] | None, scale: float, expected: float
) -> None:
    piece = replace(BENCH, sit=(replace(at(0.0), rests_at=rests_at),))
    sized = furniture_bank.scaled(piece, scale)
    assert sized.size_m[1] == pytest.approx(0.7 * expected)
    assert sized.sit[0].rests_at is None


def test_an_unstable_piece_is_reported_and_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from tests.support.hulls import hulled

    piece = hulled(replace(BENCH, sit=(replace(at(0.0), rests_at=(1.2,)),)))
    content = store.document(Built(piece, np.zeros(3), np.eye(3), None), "0" * 64, "by-hand.obj")
    store.write(tmp_path / f"mine{store.SUFFIX}", content)
    (back,) = store.pieces(tmp_path)
    assert back.sit == piece.sit
    assert main(["objects", "list", str(tmp_path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "bench-hulled: a ragdoll does not stay seated at scale 0.8, 1" in said
    # files of before say nothing about it
    del content["sit"][0]["rests_at"]
    assert store.piece_of(content, "old").sit[0].rests_at is None
