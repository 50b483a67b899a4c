"""When an actor takes part in a collection."""

from actors.member import Member


def test_a_member_is_ready_once_it_has_started_and_works_for_this_collection() -> None:
    member = Member(0, handle=None, start_call="starting", requested_s=0.0)
    assert not member.ready and not member.scenes and not member.acting
    member.start_call = None
    assert member.ready
    member.superseded = "a part that another actor delivered"
    assert not member.ready
