"""A model in space with the elements of its second links moved as seats say, written once more for the tests."""

from __future__ import annotations

import numpy as np

from reference.maximal_space import Data, Frame, element, point, rotation

__all__ = ["moved"]


def moved(data: Data, seats: dict[str, float]) -> Data:
    """The model in space with second elements moved as the offsets say."""
    links = {name: {**link, "points": dict(link["points"])} for name, link in data["links"].items()}
    defaults = data.get("joint_defaults", {})
    for name, joint in data["joints"].items():
        own = {key.removeprefix(f"seats.{name}."): n for key, n in seats.items() if key.startswith(f"seats.{name}.")}
        if not own:
            continue
        pin, guide = ({**defaults.get(key, {}), **joint.get(key, {})} for key in ("pin", "guide"))
        link = joint["links"][1]
        if joint["type"] == "spherical":
            shift = Frame(np.array([own[f"1.{axis}"] for axis in "xyz"]), np.eye(3))
        else:
            length = guide["length"] if joint["type"] == "prismatic" else pin.get("length", pin.get("bearing"))
            (x1, y1), (x2, y2) = ([own[f"{end}.{axis}"] for axis in "xy"] for end in (1, 2))
            lean = np.array([x2 - x1, y2 - y1]) / length
            axis, size = np.array([-lean[1], lean[0], 0]), float(np.hypot(*lean))
            place = np.array([(x1 + x2) / 2, (y1 + y2) / 2, own.get("3.z", 0.0)])
            shift = Frame(place, rotation(axis, float(np.arctan(size))) if size else np.eye(3))
            middle = Frame(np.array([0, 0, pin.get("offset", 0.0)]), np.eye(3))
            shift = middle @ shift @ middle.inverse()
        links[link]["points"][name] = point(element(links[link], name) @ shift)
    return {**data, "links": links}
