"""bf16 only where it is fast."""

import torch

from world.precision import cpu_flags, decide


def test_bf16_only_where_the_processor_multiplies_it():
    assert decide("cpu", frozenset({"avx2", "fma"})).autocast is None
    assert decide("cpu", frozenset({"avx2", "avx512_bf16"})).autocast is torch.bfloat16
    assert decide("cpu", frozenset({"amx_bf16"})).autocast is torch.bfloat16
    assert decide("cuda:0").autocast is torch.bfloat16
    assert decide("mps").autocast is None


def test_reason_names_the_format_and_the_instruction():
    assert "amx_bf16" in decide("cpu", frozenset({"amx_bf16"})).reason
    assert decide("cpu", frozenset()).reason.startswith("float32")


def test_context_computes_in_the_decided_format():
    x = torch.ones(4, 4)
    with decide("cpu", frozenset({"amx_bf16"})).context():
        assert (x @ x).dtype is torch.bfloat16
    with decide("cpu", frozenset()).context():
        assert (x @ x).dtype is torch.float32


def test_flags_are_read_from_both_kinds_of_cpuinfo(tmp_path):
    file = tmp_path / "cpuinfo"
    file.write_text("processor : 0\nflags\t\t: fpu avx2 avx512_bf16\n")
    assert cpu_flags(file) == {"fpu", "avx2", "avx512_bf16"}
    file.write_text("Features\t: fp asimd bf16\n")
    assert "bf16" in cpu_flags(file)
    assert cpu_flags(tmp_path / "none") == frozenset()
