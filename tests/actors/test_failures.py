"""What happened to an actor, in one line a person can act on."""

import pytest
from ray.exceptions import GetTimeoutError, RayActorError, RayTaskError

from actors.failures import explain
from world.errors import ConfigError


def failed(cause: Exception) -> RayTaskError:
    return RayTaskError("part", "Traceback ...", cause)


def test_each_failure_has_its_line() -> None:
    assert explain(GetTimeoutError(), 2.5).startswith("no answer within 2.5 s")
    assert explain(RayActorError(), 1.0) == "its process died (killed, out of memory, or crashed)"
    assert explain(failed(ZeroDivisionError("by 0\nand more")), 1.0) == "ZeroDivisionError: by 0"
    assert explain(OSError(), 1.0) == "OSError: no message"


def test_what_a_person_got_wrong_is_raised_as_itself() -> None:
    with pytest.raises(ConfigError, match=r"^choose another chair$"):
        explain(failed(ConfigError("choose another chair")), 1.0)
