"""Hulls: mass, inertia, thickness, and that they cover the piece."""

import numpy as np
import pytest
import trimesh

from tests.support.world.meshes import TRIANGLES
from world.furniture.catalogue import find
from world.meshes import decompose, source
from world.meshes.build import ImportOptions, build

CHAIR = find("chair-train-000")


def test_a_box_by_hand_has_its_mass_and_inertia() -> None:
    x, y, z = 0.4, 0.6, 1.0
    corners = np.array([[i * x, j * y, k * z] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    hull = decompose.closed(corners)
    assert hull is not None
    assert len(hull.faces) == 12
    mass, centre, inertia = decompose.mass_properties((hull,), 100.0)
    assert mass == pytest.approx(24.0)
    assert np.allclose(centre, (0.2, 0.3, 0.5))
    expected = 24.0 / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
    assert np.allclose(inertia, np.diag(expected))
    assert decompose.mass_properties((hull,), 100.0, 20.0)[0] == mass
    heavier, centre, inertia = decompose.mass_properties((hull,), 100.0, 48.0)
    assert heavier == pytest.approx(48.0) and np.allclose(centre, (0.2, 0.3, 0.5))
    assert np.allclose(inertia, 2 * np.diag(expected))
    box = decompose.around(hull)
    assert np.allclose(sorted(box.half_m), (0.2, 0.3, 0.5))


def test_two_hulls_by_trimesh() -> None:
    a = trimesh.creation.icosphere(2, 0.2)
    b = trimesh.creation.box((0.3, 0.2, 0.5))
    a.apply_translation((0.1, 0.7, 0.2))
    hulls = tuple(h for m in (a, b) if (h := decompose.closed(np.asarray(m.vertices))) is not None)
    mass, centre, inertia = decompose.mass_properties(hulls, 50.0)
    both = trimesh.util.concatenate([a.convex_hull, b.convex_hull])
    assert mass == pytest.approx(50.0 * both.volume, rel=1e-6)
    assert np.allclose(centre, both.center_mass, atol=1e-6)
    assert np.allclose(inertia, 50.0 * both.moment_inertia, rtol=1e-5, atol=1e-6)


def test_a_sheet_gets_a_thickness_and_a_hull_is_cut_level() -> None:
    flat = np.array([[0, 0, 0.0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    sheet = decompose.closed(flat)
    assert sheet is not None
    assert np.ptp(np.array(sheet.vertices_m), axis=0)[2] == pytest.approx(decompose.THINNEST_M)
    roof = decompose.closed(np.concatenate((flat, [[0.5, 0.5, 0.1]])))
    assert roof is not None
    lower = decompose.lowered(roof, 0.06)
    assert lower is not None
    assert np.array(lower.vertices_m)[:, 2].max() == pytest.approx(0.06)
    # a pyramid of volume 1/3 * 0.1 less its tip, which is (0.4)^3 of it
    mass, _, _ = decompose.mass_properties((lower,), 1.0)
    assert mass == pytest.approx(0.1 / 3 * (1 - 0.4**3))
    assert decompose.lowered(roof, 0.2) is roof


def test_a_decomposition_covers_the_chair() -> None:
    made = build(source.Source("mine", TRIANGLES.reshape(-1, 3),
                               np.arange(len(TRIANGLES) * 3).reshape(-1, 3), ".obj"),
                 ImportOptions(category="chair"))  # fmt: skip
    assert 4 <= len(made.piece.hulls) <= 16
    assert all(len(h.vertices_m) <= 48 for h in made.piece.hulls)
    assert np.allclose(made.piece.size_m, CHAIR.size_m, atol=0.02)
    assert made.seat_error_m == pytest.approx(0.0, abs=0.02)
    assert 0.5 < made.piece.mass_kg < 20.0
    assert np.linalg.eigvalsh(made.inertia_kg_m2).min() > 0.0
