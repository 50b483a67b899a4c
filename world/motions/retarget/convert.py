"""Retargeting of a recording to a clip: scaling, contacts, inverse kinematics."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from world.character import model as character
from world.character.soles import ANKLE_M
from world.errors import ClipError
from world.motions.clip import Clip, validate
from world.motions.formats import landmarks, recording
from world.motions.formats.landmarks import Map
from world.motions.formats.recording import Recording
from world.motions.licences import named
from world.motions.objects import Skeleton
from world.motions.retarget import body, contacts, solve, tracked
from world.refusals import refusing


def retargeted(source: Recording, given: Map | None = None) -> Clip:
    """The recording on our character at 30 Hz, with the recorded skeleton as its ghost.

    Raises ClipError where joints are not found, units are implausible or frames are missing.
    """
    with refusing(ClipError, Path(source.source), "motion"):
        return _retargeted(source, given or Map())


def stated(source: Recording, given: Map) -> Recording:
    """The recording at the given rate, in the given unit and with the given upward axis."""
    source = replace(source, fps=given.fps or source.fps, up=given.up or source.up)
    if given.unit_m is None:
        return source
    if source.bones_known:
        # the bones are those of a body model, in metres: the unit is that of the travel
        away = (given.unit_m - 1.0) * source.position[:, :1]
        return replace(source, position=source.position + away)
    return replace(source, unit_m=given.unit_m)


def _retargeted(source: Recording, given: Map) -> Clip:
    source = recording.validate(stated(source, given))
    if source.own_body:
        scaled, target = body.own(source, character.CONTROL_HZ)
        scaled = scaled.lowered(contacts.uneven_floor(target, scaled.fps))
        target = body.own_targets(scaled)
    else:
        joint = landmarks.find(source, given.joints)
        scaled = body.scaled(source, joint, character.CONTROL_HZ)
        scaled = scaled.lowered(contacts.uneven_floor(body.targets(scaled), scaled.fps))
        target = body.targets(scaled)
    held = contacts.held(target, contacts.find(target, scaled.fps))
    root, local = solve.solved(held)
    drop = np.array([0, 0, scaled.ankle_m - ANKLE_M])
    ghost = Skeleton(
        names=source.names,
        parents=source.parents,
        position_m=(scaled.position - drop).astype(np.float32),
    )
    return validate(
        Clip(
            name=source.name,
            fps=scaled.fps,
            root_position_m=root,
            local_rotation=local,
            source=named(source.source, source.dataset),
            licence=source.licence,
            box=tracked.track(scaled.box, target, drop) if scaled.box else None,
            ghost=ghost,
        )
    )
