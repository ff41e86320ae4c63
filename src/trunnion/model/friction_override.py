"""Plain data of a model with another friction law."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from trunnion.joints.friction import FRICTION_LAWS

__all__ = ["with_law"]


def with_law(data: dict[str, Any], law: str, complete: bool = False) -> dict[str, Any]:
    """The data, which are changed, with a friction law wherever there is friction, or for "off" without friction.

    Parameters that the laws share are kept. complete: with a 1, in SI, for each parameter that the law needs and that
    is not stated.
    """
    declared = {} if law == "off" else FRICTION_LAWS[law].parameters
    needed = {key: 1.0 for key, one in declared.items() if complete and one.default is None}
    shared = _kept(data.get("joint_defaults", {}).get("friction"), declared)
    holders = [data.get("joint_defaults", {}), *data.get("joints", {}).values(), *data.get("loop", [])]
    for holder in (one for one in holders if "friction" in one):
        own = _kept(holder.pop("friction"), declared)
        if law != "off":
            missing = {key: one for key, one in needed.items() if key not in shared}
            holder["friction"] = {"law": law, **missing, **own}
    return data


def _kept(friction: Any, declared: Collection[str]) -> dict[str, Any]:
    """What a statement of friction, short or long, keeps where the parameters of the law are others."""
    if friction is None:
        return {}
    stated = friction if isinstance(friction, Mapping) else {"coefficient": friction}
    return {key: value for key, value in stated.items() if key in ("model", *declared)}
