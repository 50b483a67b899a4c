"""Failures by segment: counts that decay, published and restored."""

import pytest
import torch

from learner.segments import Failures


def episodes(segment: list[float], fall: list[float]) -> dict[str, torch.Tensor]:
    return {"segment": torch.tensor(segment), "fall": torch.tensor(fall)}


def test_failures_are_counted_by_segment_and_fade() -> None:
    found = Failures()
    assert found.published() == {}
    found.add({"fall": torch.ones(3)})
    assert found.published() == {}
    found.add(episodes([2, 2, 0, 1], [1, 1, 1, 0]))
    assert found.published()["world.failures"].tolist() == [1.0, 0.0, 2.0]
    found.add(episodes([4], [1]))
    assert found.published()["world.failures"].tolist() == pytest.approx([0.98, 0, 1.96, 0, 1])


def test_the_order_of_episodes_does_not_matter_and_a_restart_goes_on() -> None:
    one, other = Failures(), Failures()
    one.add(episodes([3, 0, 3, 1], [1, 1, 1, 1]))
    other.add(episodes([1, 3, 3, 0], [1, 1, 1, 1]))
    again = Failures()
    again.load_state_dict(one.state_dict())
    for counts in (other, again):
        assert torch.equal(counts.published()["world.failures"], one.published()["world.failures"])


def test_pieces_are_rated_by_the_episodes_that_tell_them() -> None:
    found = Failures()
    told = torch.tensor([2.0, 2.0, 0.0, torch.nan, 2.0, 0.0])
    found.add({"piece_sit": told, "success": torch.tensor([0.0, 1.0, 1.0, 0.0, 0.0, 1.0])})
    assert "world.failures" not in found.published()
    rates = found.published()["world.piece_sit"]
    torch.testing.assert_close(rates, torch.tensor([0.0, torch.nan, 2 / 3]), equal_nan=True)
    found.add({"piece_sit": torch.tensor([2.0]), "success": torch.tensor([1.0])})
    # of 3 x 0.98 and one more, 2 x 0.98 failed
    assert found.published()["world.piece_sit"][2] == pytest.approx(1.96 / 3.94)
    again = Failures()
    again.load_state_dict(found.state_dict())
    torch.testing.assert_close(
        again.published()["world.piece_sit"], found.published()["world.piece_sit"], equal_nan=True
    )
    # a run of a version that knew no pieces
    again.load_state_dict({"counts": torch.ones(2)})
    assert again.published()["world.failures"].tolist() == [1.0, 1.0]


def test_usages_count_their_pieces_apart() -> None:
    """In a mixture number 1 is a chair of sit and a bed of lie."""
    found, nan = Failures(), torch.nan
    told = {"piece_sit": torch.tensor([1.0, nan]), "piece_lie": torch.tensor([nan, 1.0])}
    found.add({**told, "success": torch.tensor([0.0, 1.0])})
    assert found.published()["world.piece_sit"][1] == 1.0
    assert found.published()["world.piece_lie"][1] == 0.0
