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
    initial, carry, track = world.initial, world.carry, world.track
    ranges = [world.scale, initial.near_m, initial.front_m, initial.far_m]
    ranges += [carry.scale, carry.stand_m, carry.target_m, carry.near_target_m]
    ranges += [track.size, track.weight_kg, track.friction]
    assert all(0.0 < low < high for low, high in ranges)
    assert sum(initial.reference_stages) == 1.0
