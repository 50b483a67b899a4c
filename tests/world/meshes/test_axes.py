"""The upward axis from the geometry: the package's pieces in every pose, and invented ones."""

import numpy as np
import pytest

from tests.support.world.meshes import y_up
from world.errors import PieceError
from world.furniture.catalogue import find
from world.furniture.surface import triangles
from world.meshes import axes
from world.meshes.frame import Frame
from world.meshes.source import Source

Box = tuple[float, float, float, float, float, float]


def boxes(*parts: Box) -> np.ndarray:
    """Triangles of axis-aligned boxes x0, x1, y0, y1, z0, z1; metres, z up, +x front."""
    import trimesh

    found = []
    for x0, x1, y0, y1, z0, z1 in parts:
        box = trimesh.creation.box((x1 - x0, y1 - y0, z1 - z0))
        found.append(np.array(box.triangles) + np.array([x0 + x1, y0 + y1, z0 + z1]) / 2)
    return np.concatenate(found)


def legs(x: float, y: float, height: float, width: float = 0.05) -> list[Box]:
    return [
        (a - width / 2, a + width / 2, b - width / 2, b + width / 2, 0.0, height)
        for a in (-x, x)
        for b in (-y, y)
    ]


SOFA = boxes(
    (-0.45, 0.45, -1.0, 1.0, 0.1, 0.42), (-0.45, -0.22, -1.0, 1.0, 0.42, 0.85),
    (-0.45, 0.45, -1.0, -0.82, 0.42, 0.62), (-0.45, 0.45, 0.82, 1.0, 0.42, 0.62),
    *legs(0.4, 0.95, 0.1),
)  # fmt: skip
BED = boxes(
    (-1.0, 1.0, -0.7, 0.7, 0.25, 0.5), (-1.05, -1.0, -0.7, 0.7, 0.0, 0.95), *legs(0.95, 0.65, 0.25)
)
TABLE = boxes((-0.4, 0.4, -0.8, 0.8, 0.7, 0.74), *legs(0.35, 0.75, 0.7))
CHAIR = boxes(
    (-0.22, 0.22, -0.22, 0.22, 0.42, 0.46), (-0.22, -0.18, -0.22, 0.22, 0.46, 0.92),
    *legs(0.2, 0.2, 0.42, 0.04),
)  # fmt: skip
SHAPES = {"sofa": SOFA, "bed": BED, "table": TABLE, "chair": CHAIR}
OWN = {
    f"{name}-0": triangles(find(f"{name}-train-000"))
    for name in ("chair", "armchair", "sofa", "bed", "table")
}


def source(corners: np.ndarray, suffix: str = ".obj") -> Source:
    return Source("it", corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3), suffix)


@pytest.mark.parametrize("corners", [*SHAPES.values(), *OWN.values()], ids=[*SHAPES, *OWN])
def test_upright_pieces_stay_and_turned_ones_are_found(corners: np.ndarray) -> None:
    x, y, z = np.moveaxis(corners, -1, 0)
    for upright in (corners, np.stack((y, -x, z), -1)):  # front +x, and -y as in Blender
        assert axes.resolved(source(upright), Frame()) == (Frame(), ())
    for turned in (y_up(corners), np.stack((-y, z, -x), -1)):  # y up, front +z and -z
        frame, notes = axes.resolved(source(turned), Frame())
        assert frame.up == "+y" and notes == (
            "taken with y up, as it stands so; --up +z and --up +y state it",
        )


@pytest.mark.parametrize("name", SHAPES)
def test_a_unit_or_a_height_counts(name: str) -> None:
    turned = y_up(SHAPES[name])
    assert axes.resolved(source(100 * turned), Frame(unit="cm"))[0] == Frame("+y", unit="cm")
    high = float(np.ptp(turned[..., 1]))
    assert axes.resolved(source(7 * turned), Frame(height_m=high))[0].up == "+y"
    # neither of a wrong unit: the refusal names unit and axis
    assert axes.resolved(source(100 * turned), Frame()) == (Frame(), ())


def test_what_is_stated_stays() -> None:
    turned = source(y_up(SOFA))
    for frame in (Frame(up="+z"), Frame(size_m=(0.9, 2.0, 0.85))):
        assert axes.resolved(turned, frame) == (frame, ())
    assert axes.resolved(source(SOFA, ".glb"), Frame()) == (Frame(), ())  # glTF defines y up
    assert axes.resolved(source(y_up(SOFA)), Frame(front="+x"))[0] == Frame("+y", "+x")


@pytest.mark.parametrize("name", ["chair", "bed", "table"])
def test_a_piece_on_its_back_is_refused_with_its_axis(name: str) -> None:
    x, y, z = np.moveaxis(SHAPES[name], -1, 0)
    lying = source(np.stack((z, y, -x), -1))
    with pytest.raises(PieceError, match=r"lies on its back or side .* stands with --up \+x; give"):
        axes.resolved(lying, Frame())
    assert axes.resolved(lying, Frame(), force=True)[0] == Frame()


def test_another_unit_is_named_before_another_axis() -> None:
    """A chair in feet, read as metres, is too high for furniture where it stands upright."""
    chair_m = boxes(
        (-0.22, 0.22, -0.22, 0.22, 0.41, 0.45), (-0.22, -0.18, -0.22, 0.22, 0.45, 0.9),
        *legs(0.2, 0.2, 0.41, 0.04),
    )  # fmt: skip
    found = source(chair_m / 0.3048)
    with pytest.raises(PieceError, match=r"is odd, and with --unit ft it is ordinary furniture"):
        axes.resolved(found, Frame())
    assert axes.resolved(found, Frame(unit="ft")) == (Frame(unit="ft"), ())


def test_an_upside_down_chair_is_named_as_such() -> None:
    with pytest.raises(PieceError, match="stands with --up -z; give"):
        axes.resolved(source(CHAIR * [1.0, -1.0, -1.0]), Frame())


def test_support_and_asymmetry_by_hand() -> None:
    corners = np.unique(boxes((0, 1, 0, 1, 0, 1)).reshape(-1, 3), axis=0)
    assert axes.support(corners) == pytest.approx(1.0) and axes.asymmetry(corners) == 0.0
    pyramid = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 1.0]])
    assert axes.support(pyramid) == pytest.approx(0.5)  # a triangle of 2 on a square of 4
    assert axes.asymmetry(pyramid) == pytest.approx(1.0)  # three below, one above, none alike
