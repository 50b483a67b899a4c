"""A mixed shard against the shards of its tasks, by hand."""

from dataclasses import replace
from functools import cache

import torch

from tests.support.track_scenes import WORLD, bank, motions
from world import tasks
from world.character import model as character
from world.config import WorldConfig
from world.episodes.mixed import MixedShard, kinds
from world.episodes.shard import Shard
from world.motions.library import MotionLibrary
from world.objects.bank import ObjectBank
from world.tasks.mixture import Mixture, mixture

BLOCK = 16


@cache
def mixed() -> Mixture:
    return mixture({"sit": 0.25, "track": 0.75}, BLOCK)


@cache
def seats() -> tuple[WorldConfig, MotionLibrary, ObjectBank]:
    world = WorldConfig(task="sit", pieces=2, scales=1, episode_s=10.0)
    task = tasks.make("sit")
    library = MotionLibrary(list(motions().clips[2:3]), True, task.affordance.clips)
    return world, library, task.affordance.bank(world)


def parts(scenes: range) -> tuple[list[Shard], list[torch.Tensor]]:
    world, library, pieces = seats()
    own = [mixed().scenes(k, scenes, BLOCK) for k in range(2)]
    sit = Shard(world, library, pieces, own[0], 5)
    track = Shard(replace(WORLD), motions(), bank(), own[1], 5)
    return [sit, track], [torch.tensor(ids) - scenes.start for ids in own]


def shard(scenes: range) -> MixedShard:
    return MixedShard(mixed(), *parts(scenes))


def action(k: int, n: int) -> torch.Tensor:
    return 0.3 * torch.sin(torch.arange(n * character.NU).view(n, -1) + k)


def test_a_step_is_that_of_the_tasks_in_the_order_of_the_scenes() -> None:
    scenes = range(32)
    one = shard(scenes)
    alone, places = parts(scenes)
    terms = [len(task.terms) for task in mixed().parts]
    ended = 0
    for k in range(30):
        steps = [s.step(action(k, 32)[p]) for s, p in zip(alone, places, strict=True)]
        step = one.step(action(k, 32))
        state, goal = one.observe()
        for number, (theirs, place) in enumerate(zip(steps, places, strict=True)):
            assert torch.equal(step.reward[place], theirs.reward)
            assert torch.equal(step.fell[place], theirs.fell)
            first = sum(terms[:number])
            own = step.terms[place]
            assert torch.equal(own[:, first : first + terms[number]], theirs.terms)
            assert int(own.count_nonzero()) == int(theirs.terms.count_nonzero())
            seen, wanted = alone[number].observe()
            assert torch.equal(state[place], seen)
            assert torch.equal(goal[place], mixed().embed(number, wanted))
        assert step.end_ids.tolist() == sorted(
            place[i] for s, place in zip(steps, places, strict=True) for i in s.end_ids.tolist()
        )
        for row, scene in enumerate(step.end_ids.tolist()):
            number = int(scene in places[1].tolist())
            theirs, place = steps[number], places[number].tolist()
            at = theirs.end_ids.tolist().index(place.index(scene))
            assert torch.equal(step.end_states[row], theirs.end_states[at])
            assert step.episodes["return"][row] == theirs.episodes["return"][at]
            name = kinds(mixed())[int(step.episodes["start"][row])]
            assert name.startswith(mixed().names[number])
            # what a task does not record is unknown, not 0
            assert bool(step.episodes["segment"][row].isnan()) == (number == 0)
            ended += 1
    assert ended > 10


def test_scenes_are_the_same_however_they_are_divided_and_after_a_restart() -> None:
    whole, half = shard(range(32)), shard(range(16, 32))
    for k in range(20):
        step, part = whole.step(action(k, 32)), half.step(action(k, 32)[16:])
        assert torch.equal(step.reward[16:], part.reward)
    again = shard(range(32))
    again.load_state_dict(whole.state_dict())
    second = shard(range(16, 32))
    second.load_state_dict(
        {k: v[16:] if v.ndim and len(v) == 32 else v for k, v in whole.state_dict().items()}
    )
    assert whole.clock == again.clock == second.clock
    for k in range(10):
        rewards = [s.step(a).reward for s, a in ((whole, action(k, 32)), (again, action(k, 32)))]
        assert torch.equal(*rewards)
        assert torch.equal(rewards[0][16:], second.step(action(k, 32)[16:]).reward)
