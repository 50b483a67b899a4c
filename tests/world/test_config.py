"""Settings of a world as keys: banks and libraries are made once for equal ones."""

from dataclasses import replace

from world.config import CarryConfig, WorldConfig


def test_equal_settings_are_one_key() -> None:
    one = WorldConfig(motions=("a",), carry=CarryConfig(weight_kg=(1.0, 12.0)))
    same = replace(WorldConfig(), motions=("a",), carry=replace(one.carry))
    other = replace(one, carry=replace(one.carry, sizes=95))
    assert one == same and hash(one) == hash(same)
    assert len({one, same, other}) == 2


def test_ranges_are_given_from_low_to_high() -> None:
    world = WorldConfig()
    ranges = [world.scale, world.near_m, world.front_m, world.far_m]
    carry = world.carry
    ranges += [carry.scale, carry.stand_m, carry.target_m, carry.near_target_m]
    assert all(0.0 < low < high for low, high in ranges)
    assert sum(world.clip_stages) == 1.0
