"""A shard that follows clips: the reference advances, actions are added to its set-points, ends are
told apart."""

from dataclasses import replace

import torch

from tests.support.track_scenes import WORLD, bank, followed, motions
from world.character import model as character
from world.episodes.shard import Shard


def shard(scenes: range = range(16), residual: bool = True) -> Shard:
    world = replace(WORLD, track=replace(WORLD.track, residual=residual))
    return Shard(world, motions(), bank(), scenes, 5)


def test_the_reference_advances_one_frame_a_step_and_episodes_tell_where_they_ended() -> None:
    one = shard()
    told = 0
    for _ in range(40):
        before = one.state_dict()["frame"]
        step = one.step(torch.zeros(16, character.NU))
        after = one.state_dict()["frame"]
        going = torch.ones(16, dtype=torch.bool)
        going[step.end_ids] = False
        assert torch.equal(after[going], followed().ahead(before[going], 1))
        ended = followed().ahead(before[step.end_ids], 1)
        assert step.episodes["segment"].tolist() == followed().segment[ended].tolist()
        kinds = torch.stack([v for k, v in step.episodes.items() if k.startswith("end_")])
        assert torch.equal(kinds.amax(dim=0) > 0, step.episodes["fall"] > 0)
        assert not bool((step.fell & step.timed_out).any())
        told += len(step.end_ids)
    assert told > 5


def test_an_action_is_added_to_the_references_set_point_within_the_bounds() -> None:
    one, other = shard(), shard(residual=False)
    action = torch.full((16, character.NU), 0.2)
    low, high = (torch.from_numpy(bound) for bound in character.set_point_bounds())
    frame = one.state_dict()["frame"]
    base = followed().set_point[followed().ahead(frame, 1)].double()
    wanted = torch.maximum(torch.minimum(base + 0.2 * 0.35 * (high - low), high), low)
    target = one._target()
    assert torch.allclose(one._scenes.set_points(action, target.set_points()), wanted)
    assert other._target().set_points() is None


def test_the_end_of_a_clip_is_a_time_out() -> None:
    one = shard()
    state = one.state_dict()
    last = followed().stop[followed().clip[state["frame"]]] - 1
    state["frame"] = last - 1
    state["steps"] = torch.zeros_like(state["steps"])
    one.load_state_dict(state)
    step = one.step(torch.zeros(16, character.NU))
    assert torch.equal(step.timed_out, ~step.fell)


def test_scenes_are_the_same_however_they_are_divided_and_after_a_restart() -> None:
    whole, half = shard(), shard(range(8, 16))
    failures = {"failures": torch.arange(30.0)}
    for each in (whole, half):
        each.update_sampling(failures)
    for k in range(25):
        action = 0.1 * torch.sin(torch.arange(16 * character.NU).view(16, -1) + k)
        step, part = whole.step(action), half.step(action[8:])
        assert torch.equal(step.reward[8:], part.reward)
    again = shard()
    again.load_state_dict(whole.state_dict())
    again.update_sampling(failures)
    for k in range(10):
        action = 0.1 * torch.cos(torch.arange(16 * character.NU).view(16, -1) + k)
        assert torch.equal(whole.step(action).reward, again.step(action).reward)
        for ours, theirs in zip(whole.observe(), again.observe(), strict=True):
            assert torch.equal(ours, theirs)
