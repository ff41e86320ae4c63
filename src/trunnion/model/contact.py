"""What a joint of a type moves and touches with, and which sizes its friction needs."""

from __future__ import annotations

from collections.abc import Mapping

from trunnion.algebra.namespace import Number
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.joints.pairs import PAIRS
from trunnion.model.joint_parts import Joint

__all__ = [
    "PLAY_PAIRS", "TURNING_PAIRS", "clearance", "contact_lacks", "has_guide", "has_pin", "has_play", "motions", "play",
]  # fmt: skip

_PLAYS = {kind: model for models in CLEARANCE_MODELS.values() for kind, model in models.items()}
PLAY_PAIRS = tuple(_PLAYS)  # those whose play is modelled
TURNING_PAIRS = tuple(kind for kind, model in _PLAYS.items() if model.turns)  # of these those in which nothing slides


def motions(joint_type: str) -> tuple[str, ...]:
    """Which of rotation and slide a joint of this type makes about and along the one axis that both links share."""
    return PAIRS[joint_type].motions


def has_pin(joint_type: str) -> bool:
    """Whether a joint of this type has a pin (or ball) in a hole."""
    return PAIRS[joint_type].turns


def has_guide(joint_type: str) -> bool:
    """Whether a joint of this type has a slider in a guide."""
    return PAIRS[joint_type].guided


def contact_lacks(joint: Joint, spatial: bool) -> tuple[str, ...]:
    """Sizes of pin or guide that friction in this joint needs and that are not stated, such as ("radius",)."""
    if has_guide(joint.type):
        return () if joint.guide and joint.guide.length else ("length",)
    radius = () if joint.pin and joint.pin.radius else ("radius",)
    if not spatial or PAIRS[joint.type].ball:
        return radius
    return radius if joint.pin and (joint.pin.bearing or joint.pin.length) else (*radius, "bearing")


def has_play(joint: Joint) -> bool:
    """Whether a joint is of a type whose play is modelled and states one, be it 0."""
    if joint.type not in PLAY_PAIRS:
        return False
    if has_guide(joint.type):
        return joint.guide is not None and joint.guide.clearance is not None
    pin = joint.pin
    if pin is None:
        return False
    return (
        pin.clearance is not None
        or pin.end_float is not None
        or (pin.radius is not None and pin.hole_radius is not None)
    )


def clearance(name: str, values: Mapping[str, Number]) -> Number | None:
    """Radial clearance R − r of a joint's pin, or play of its guide to either side, m; None if none is stated.

    values: by path.
    """
    for part in ("pin", "guide"):
        path = f"joints.{name}.{part}"
        if f"{path}.clearance" in values:
            return values[f"{path}.clearance"]
        if f"{path}.hole_radius" in values and f"{path}.radius" in values:
            return values[f"{path}.hole_radius"] - values[f"{path}.radius"]
    return None


def play(joint: Joint, name: str, values: Mapping[str, Number]) -> Number:
    """How far each end of a joint's pin, slider or ball can lie from the middle of its hole, m; 0 without a play.

    The radial clearance, that between the radii where none is stated, and the cylindricity; of a pin with neither half
    its end float. values: by path.
    """
    if not has_play(joint):
        return 0.0
    if has_guide(joint.type):
        return values[f"joints.{name}.guide.clearance"]
    pin, stated = f"joints.{name}.pin", clearance(name, values)
    across = 0.0 if stated is None else stated + values.get(f"{pin}.cylindricity", 0.0)
    return across if across != 0 else 0.5 * values.get(f"{pin}.end_float", 0.0)
