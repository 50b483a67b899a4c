"""Pushes by hand."""

import numpy as np
import pytest

from console.play.pushes import MAX_IMPULSE_N_S, Pushes
from world.character import model as character
from world.errors import ChoiceError


def test_an_impulse_is_a_force_over_one_step() -> None:
    pushes, force = Pushes(0.1), np.ones((len(character.BODIES) + 1, 6))
    pushes.add(np.array([3.0, 0.0, 0.0]), "torso")
    pushes.add(np.array([0.0, 4.0, 0.0]), "torso")
    pushes.add(np.array([0.0, 0.0, 3.0 * MAX_IMPULSE_N_S]), "pelvis")
    pushes.apply(force)
    torso = 1 + character.BODIES.index("torso")
    assert force[torso].tolist() == [30.0, 40.0, 0.0, 0.0, 0.0, 0.0]
    assert force[1, 2] == pytest.approx(10.0 * MAX_IMPULSE_N_S)
    assert np.count_nonzero(force) == 3
    # none is given twice
    pushes.apply(force)
    assert not force.any()
    pushes.add(np.array([3.0, 0.0, 0.0]), "head")
    pushes.clear()
    pushes.apply(force)
    assert not force.any()


def test_an_unknown_body_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(ChoiceError, match="head"):
        Pushes(0.1).add(np.zeros(3), "tail")
