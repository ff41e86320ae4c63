"""Sweeps made by hand, for what their figures and tables must bear: any number of names, gaps, odd values and units."""

import json
from itertools import product

import numpy as np
import xarray as xr

from trunnion.results.dataset import MemberUnits, described, with_variables
from trunnion.studies.sweep_grid import FIGURES

RPM, DEG = np.pi / 30, np.pi / 180
UNITS = {
    "effort": MemberUnits("driver", ["N m", "N m"]),
    "transmission_error": MemberUnits("joint", ["rad", "rad", "m"]),
}


def scale(values, unit="1", written="", factor=1.0):
    """A swept number: values in the unit they were written in."""
    return np.asarray(values, float), unit, written, factor


ANGLE = scale(np.linspace(0, 30, 13), "rad", "deg", DEG)
SPEED = scale(np.linspace(50, 1500, 20), "rad/s", "rpm", RPM)


def swept(names, law=None, status=None, ideal=False, name="Cardan joint", margin=True):
    """A Dataset as `sweep` makes it. law: efficiency from the written values; status: code from them, 0 if none."""
    coordinates = {
        one: xr.Variable(one, values * factor, {
            "units": unit, "long_name": one, "written_unit": written, "written_factor": factor,
        })
        for one, (values, unit, written, factor) in names.items()
    }  # fmt: skip
    points = list(product(*(values for values, *_ in names.values())))
    shape = [len(values) for values, *_ in names.values()]
    law = law or (lambda *place: 0.9 - 0.1 * sum(place) / 1500)
    codes = np.array([status(*point) if status else 0 for point in points]).reshape(shape)
    base = np.array([law(*point) for point in points], float).reshape(shape)
    base = np.where(codes >= 4, np.nan, base)
    labels = {"driver": ["input", "Ω"], "joint": ["pin-1", "output", "$x_1$"]}
    given = {}
    for key, one in FIGURES.items():
        if (one.part == "errors" and not ideal) or (key == "locking_margin" and not margin):
            continue
        count = [len(labels[dim]) for dim in one.dims]
        values = base * np.ones([*count, *shape])
        if key.startswith(("drive_effort", "reaction")):
            values = values * 12500 * np.arange(1, count[0] + 1).reshape(-1, *[1] * len(shape))
        if key == "efficiency_ideal":
            values = np.minimum(values + 0.05, 1)
        if key == "locking_margin":
            values = np.where(codes == 5, 0.7, np.where(base > 0.85, np.inf, 1 + 8 * base))
        if key in ("status", "without_answer"):
            values = codes if key == "status" else np.where(codes >= 4, 3, 0)
        given |= described({key: values}, {key: one.over(*names)}, UNITS)
    attributes = {
        "kind": "sweep", "name": name, "swept": json.dumps(list(names), ensure_ascii=False),
        "scale_of_length": 1.0, "scale_of_rate": 1.0, "scale_of_force": 1.0, "findings": "[]", "steps": 36,
    }  # fmt: skip
    empty = xr.Dataset({}, {**{dim: (dim, np.array(one)) for dim, one in labels.items()}, **coordinates}, attributes)
    return with_variables(empty, given)


def cardan(angle, speed, *_):
    """Something like the efficiency of the shaft joint, over deg and rpm."""
    return 0.9 - 0.0035 * angle - 0.2 * (speed / 1500) ** 2
