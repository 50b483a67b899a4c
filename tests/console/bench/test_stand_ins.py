"""A stand-in does one thing after the other."""

from concurrent.futures import ThreadPoolExecutor

from actors.ray_actor import pack_rollout
from console.bench.stand_ins import Sleepers
from policy.rollout import Rollout


def test_stand_ins_do_one_thing_after_the_other(part: Rollout) -> None:
    """As a real actor: what it is asked for while it acts waits; another actor does not."""
    held = Sleepers(pack_rollout(part))
    with ThreadPoolExecutor(2) as pool, held._acting[0]:
        waiting = pool.submit(held.rollout, {}, 0, 0, 0, 0.0)
        assert pool.submit(held.rollout, {}, 1, 1, 0, 0.0).result(60)["version"] == 1
        assert not waiting.done()
    assert waiting.result(60)["version"] == 0
