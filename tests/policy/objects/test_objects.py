"""Every kind of object that a task uses has an adapter; what a request lacks is named."""

import pytest

from policy.errors import RequestError
from policy.objects import ADAPTERS, adapter, props_of
from rpc.v1 import policy_pb2 as pb
from tests.support.policy_cases import SIT
from world import tasks


def test_every_task_has_an_adapter() -> None:
    assert {tasks.make(name).affordance.kind for name in tasks.REGISTRY} == set(ADAPTERS)
    assert adapter(SIT) is ADAPTERS["furniture"]


def test_what_is_missing_is_named() -> None:
    with pytest.raises(RequestError, match=r"^box: missing, 'carry' needs it$"):
        props_of(pb.SynthesizeRequest(), tasks.make("carry"))
    with pytest.raises(RequestError, match=r"^furniture: missing, 'sit' needs it$"):
        props_of(pb.SynthesizeRequest(), SIT)
