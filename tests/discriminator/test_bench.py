"""The bench of the wire measures both of its sides."""

from discriminator.bench import measure_transport

from tests.support.style_cases import SPEC


def test_the_bench_measures_both_sides() -> None:
    figures = measure_transport(SPEC, scenes=16, steps=4, rounds=3)
    assert all(name.endswith(("_ms", "_us_per_sample")) for name in figures)
    assert figures["score_rpc_ms"] > 0 < figures["train_local_ms"]
