"""What a joint of a type moves and touches with, and which sizes its friction needs."""

from __future__ import annotations

from trunnion.model.parts import Joint, freedoms

__all__ = ["contact_lacks", "has_guide", "has_pin", "motions"]

_MOTIONS = {
    "revolute": ("rotation",),
    "prismatic": ("slide",),
    "cylindrical": ("rotation", "slide"),
    "helical": ("rotation", "slide"),
}


def motions(joint_type: str) -> tuple[str, ...]:
    """Which of rotation and slide a joint of this type makes about and along the one axis that both links share."""
    return _MOTIONS.get(joint_type, ())


def has_pin(joint_type: str) -> bool:
    """Whether a joint of this type has a pin (or ball) in a hole."""
    return "rotation" in freedoms(joint_type)


def has_guide(joint_type: str) -> bool:
    """Whether a joint of this type has a slider in a guide."""
    return motions(joint_type) == ("slide",)


def contact_lacks(joint: Joint, spatial: bool) -> tuple[str, ...]:
    """Sizes of pin or guide that friction in this joint needs and that are not stated, such as ("radius",)."""
    if has_guide(joint.type):
        return () if joint.guide and joint.guide.length else ("length",)
    radius = () if joint.pin and joint.pin.radius else ("radius",)
    if not spatial or joint.type == "spherical":
        return radius
    return radius if joint.pin and (joint.pin.bearing or joint.pin.length) else (*radius, "bearing")
