"""Errors name the valid choices, in one line."""

import pytest

from world.errors import ChoiceError, InhabitError


def test_a_wrong_name_is_refused_with_the_choices() -> None:
    error = ChoiceError("task", "fly", ["sit", "carry", "lie"])
    assert str(error) == "unknown task 'fly': choose one of carry, lie, sit"
    with pytest.raises(InhabitError):
        raise error
