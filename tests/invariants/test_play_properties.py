"""What the effect of play must keep whatever the linkage: scale, frame, links named the other way, sums, gradients."""

from __future__ import annotations

import copy

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import mechanisms
import trunnion
from mechanisms_parts import Data
from played import by_duals, four_bar, plays, rssr, with_play
from trunnion import Mechanism
from trunnion.measures.measures import named
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

STEPS = 8
clearances = st.floats(1e-7, 1e-4)


def played(mechanism: Mechanism, *measures: str) -> xr.Dataset:
    return trunnion.play(mechanism, list(measures) or None, STEPS)


@pytest.mark.slow
@settings(max_examples=4)
@given(clearances, st.floats(0.1, 20))
def test_linear_in_every_clearance(clearance: float, factor: float) -> None:
    one, other = (played(rssr(rho, 3 * rho), "rotation:D") for rho in (clearance, factor * clearance))
    for key in ("worst_case", "deviation", "rss"):
        np.testing.assert_allclose(other[key], factor * one[key], rtol=1e-8)


@settings(max_examples=3)
@given(st.lists(clearances, min_size=3, max_size=3))
def test_joints_add_up(found: list[float]) -> None:
    """A joint's part is the same alone or beside others; the totals are the sum and the root of squares."""
    base, data, alone = mechanisms.four_bar(), mechanisms.four_bar(), []
    for joint, clearance in zip("BCD", found, strict=True):
        one = copy.deepcopy(base)
        one["joints"][joint]["pin"] = {"radius": 0.01, "clearance": clearance}
        data["joints"][joint]["pin"] = {"radius": 0.01, "clearance": clearance}
        alone.append(played(Mechanism(trunnion=1, **one), "rotation:D"))
    together = played(Mechanism(trunnion=1, **data), "rotation:D")
    for joint, one in zip("BCD", alone, strict=True):
        part = together["worst_case"].sel(joint=joint)
        np.testing.assert_allclose(part, one["worst_case"].sel(joint=joint), rtol=1e-12)
    total = sum(one["worst_case_total"] for one in alone)
    np.testing.assert_allclose(together["worst_case_total"], total, rtol=1e-12)
    scatter = sum(one["deviation_total"] ** 2 for one in alone)
    np.testing.assert_allclose(together["deviation_total"] ** 2, scatter, rtol=1e-12)


def test_no_clearance_no_effect() -> None:
    result = played(with_play(mechanisms.model(mechanisms.slider_crank()), 0.0), "slide:C", "effort:A")
    assert np.all(result["worst_case"].values == 0)
    assert np.all(result["deviation"].values == 0)
    assert np.any(result["sensitivity"].values != 0)


@settings(max_examples=4)
@given(st.floats(-np.pi, np.pi), st.floats(-2, 2), st.floats(-2, 2))
def test_moving_the_whole_changes_no_angle(turn: float, x: float, y: float) -> None:
    """A four-bar anywhere in the plane."""
    c, s = np.cos(turn), np.sin(turn)

    def moved(point: list[float]) -> list[float]:
        return [x + c * point[0] - s * point[1], y + s * point[0] + c * point[1]]

    data = mechanisms.four_bar()
    there = copy.deepcopy(data)
    ground = there["links"]["ground"]["points"]
    there["links"]["ground"]["points"] = {name: moved(point) for name, point in ground.items()}
    there["drivers"]["A"]["start"] = turn  # the crank's angle is measured from the ground's x
    there["assembly"] = {"C": moved(data["assembly"]["C"])}
    one, other = (played(with_play(case), "rotation:D", "rotation:C") for case in (data, there))
    np.testing.assert_allclose(other["worst_case"], one["worst_case"], rtol=1e-8)
    np.testing.assert_allclose(other["deviation"], one["deviation"], rtol=1e-8)


@settings(max_examples=4)
@given(st.floats(0.05, 20))
def test_size_does_not_matter_to_an_angle(scale: float) -> None:
    """A linkage as much larger with as much more clearance turns its output by the same."""
    one, other = (played(_scaled(mechanisms.four_bar(), size), "rotation:D") for size in (1.0, scale))
    np.testing.assert_allclose(other["worst_case"], one["worst_case"], rtol=1e-9)


def _scaled(data: Data, scale: float) -> Mechanism:
    for link in data["links"].values():
        link["points"] = {name: [scale * n for n in point] for name, point in link["points"].items()}
    data["assembly"] = {name: [scale * n for n in place] for name, place in data["assembly"].items()}
    return with_play(data, 1e-5 * scale)


@pytest.mark.parametrize("name", ["slider-crank", "class III"])
def test_which_link_has_the_hole_does_not_matter(name: str) -> None:
    """To first order: pins and holes changed over have the same worst case; a turn has the other sign."""
    data = mechanisms.MODELS[name]()
    turned = copy.deepcopy(data)
    link = next(link for link in data["links"] if link != "ground")
    for joint, stated in turned["joints"].items():
        if joint not in data["drivers"] and stated["type"] == "revolute":  # the middle of a guide is on one link only
            stated["links"] = stated["links"][::-1]
    first = next(iter(data["links"][link]["points"]))
    names = [f"{other}.{next(iter(data['links'][other]['points']))}.x" for other in data["links"] if other != "ground"]
    one, other = (played(with_play(case), *names, f"{link}.{first}.y") for case in (data, turned))
    np.testing.assert_allclose(other["worst_case"], one["worst_case"], rtol=1e-9, atol=1e-18)


def test_parts_are_the_norms_of_the_gradient() -> None:
    """With the same radius everywhere, Σ ρ²|Q|² over joints is ρ² times the squared length of the whole gradient."""
    run = prepare(with_play(mechanisms.MODELS["Watt six-bar"](), 1e-5))
    known, time = plays(run.system, run.values), run.cycle.times(STEPS)
    (measure,) = named(run.system.mechanism, ["rotation:G"], run.values)
    slopes = by_duals(run, measure, known, time, FrictionMethod())
    square = sum(part**2 for ends in slopes.values() for end in ends for part in end)
    result = played(with_play(mechanisms.MODELS["Watt six-bar"](), 1e-5), "rotation:G")
    np.testing.assert_allclose(result["rss"].values[0], 1e-5 * np.sqrt(square), rtol=1e-9)


def test_friction_and_loads_leave_the_motion_alone() -> None:
    """Play moves the links by geometry: neither friction, masses nor speed are in it."""
    plain = four_bar("C")
    data = plain.data() | {"joint_defaults": {"friction": 0.3, "pin": {"radius": 0.005}}, "gravity": [0, -9.81]}
    data["links"]["coupler"] |= {"mass": 2.0, "centre": [0.03, 0.01], "inertia": 0.01}
    data["drivers"]["A"]["speed"] = 30.0
    loaded = played(Mechanism(**data), "rotation:D")
    np.testing.assert_allclose(loaded["worst_case"], played(plain, "rotation:D")["worst_case"], rtol=1e-10)
