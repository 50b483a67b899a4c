"""The protocol of adapters: each reads one field of both kinds of messages."""

from policy.objects import ADAPTERS
from policy.objects.adapter import not_cancelled
from rpc.v1 import policy_pb2 as pb


def test_situations_and_requests_have_the_field_of_each_adapter() -> None:
    assert ADAPTERS
    for adapter in ADAPTERS.values():
        for message in (pb.Situation, pb.SynthesizeRequest):
            assert adapter.message in message.DESCRIPTOR.fields_by_name


def test_a_call_without_a_client_is_not_cancelled() -> None:
    assert not_cancelled() is False
