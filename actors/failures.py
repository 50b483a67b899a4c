"""Failures of Ray actors in one line of text."""

from ray.exceptions import GetTimeoutError, RayActorError, RayTaskError

from world.errors import InhabitError


def explain(error: Exception, deadline_s: float) -> str:
    """Return an actor's failure in one line; raise the cause itself if it is an InhabitError."""
    if isinstance(error, GetTimeoutError):
        return f"no answer within {deadline_s:g} s (hung, or no free CPU slot to start on)"
    if isinstance(error, RayTaskError):
        if isinstance(error.cause, InhabitError):
            raise error.cause from None
        return f"{type(error.cause).__name__}: {_first_line(error.cause)}"
    if isinstance(error, RayActorError):
        return "its process died (killed, out of memory, or crashed)"
    return f"{type(error).__name__}: {_first_line(error)}"


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).strip().splitlines()), "no message")
