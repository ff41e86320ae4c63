"""Pressure angles against closed forms, and against the forces and velocities of the analysis."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from mechanisms import MODELS, Array, Data, build, four_bar, slider_crank
from trunnion import Mechanism
from trunnion.solve.forward import forward
from trunnion.solve.run import prepare
from trunnion.studies import design as figures

DYADS = ["four-bar", "four-bar, other branch", "slider-crank", "inverted slider-crank", "Scotch yoke", "elliptic bar",
         "tangent drive"]  # fmt: skip


def angles(mechanism: Mechanism, steps: int = 24) -> tuple[Any, Any, dict[str, Array]]:
    run = prepare(mechanism)
    walk = forward(run.system, run.values, run.chosen.assembly, run.cycle.times(steps))
    return run, walk, figures.pressure_angles(walk)


def forwards(r: float, length: float, offset: float) -> Data:
    """A slider-crank that turns counterclockwise from 0."""
    return {**slider_crank(r, length, offset), "drivers": {"A": {"speed": 1.0}}}


@pytest.mark.parametrize("offset", [0.0, 0.1, -0.2])
def test_slider_crank(offset: float) -> None:
    """sin φ = (e − r sin θ)/l for a slide along x."""
    r, length = 0.3, 1.0
    _, _, found = angles(build(forwards(r, length, offset)))
    ((name, angle),) = found.items()
    theta = np.arange(24) * (np.pi / 12)
    np.testing.assert_allclose(np.sin(angle), (offset - r * np.sin(theta)) / length, atol=1e-14)
    extremes = figures.design(build(forwards(r, length, offset))).pressure_angle[name]
    np.testing.assert_allclose(np.sin(extremes[::2]), [(offset - r) / length, (offset + r) / length], atol=1e-12)
    np.testing.assert_allclose(extremes[1::2], [np.pi / 2, 3 * np.pi / 2], atol=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_four_bar_by_the_law_of_cosines(side: float) -> None:
    """sin φ = cos μ = (b² + c² − d²)/(2 b c), d² = a² + g² − 2 a g cos θ; extremes at 0 and π."""
    a, b, c, g = 0.3, 0.9, 0.7, 1.0
    _, _, found = angles(build(four_bar(a, b, c, g, side)))
    theta = np.arange(24) * (np.pi / 12)
    cosine = (b * b + c * c - a * a - g * g + 2 * a * g * np.cos(theta)) / (2 * b * c)
    np.testing.assert_allclose(np.sin(next(iter(found.values()))), cosine, atol=1e-13)
    extremes = next(iter(figures.design(build(four_bar(a, b, c, g, side))).pressure_angle.values()))
    np.testing.assert_allclose(extremes[1::2], [np.pi, 0.0], atol=1e-12)


@pytest.mark.parametrize("name", DYADS)
def test_it_complements_the_transmission_angle_and_the_condition(name: str) -> None:
    run, walk, found = angles(build(MODELS[name]()))
    assert found
    transmission = figures.transmission_angles(walk)
    for module, group, pose in zip(run.system.plan.modules, run.system.groups, walk.poses, strict=True):
        angle = found.get("-".join(module.joints))
        if angle is not None:
            np.testing.assert_allclose(2 / np.cos(angle), group.condition(pose), rtol=1e-12)
            np.testing.assert_allclose(transmission["-".join(module.joints)], np.pi / 2 - np.abs(angle), rtol=1e-14)


@pytest.mark.parametrize("name", DYADS)
@pytest.mark.parametrize("loaded", [1, 0])
def test_it_is_between_the_force_and_the_velocity_of_the_analysis(name: str, loaded: int) -> None:
    """Massless, no friction, loads on one link of the dyad alone: the other is a two-force link."""
    data: Data = copy.deepcopy(MODELS[name]())
    for link in data["links"].values():
        for key in ("mass", "inertia", "centre", "inertia_about"):
            link.pop(key, None)
    mechanism = build({**data, "loads": {}, "gravity": [0, 0]}).with_friction("off")
    module = next(one for one in prepare(mechanism).system.plan.modules if len(one.links) == 2)
    if module.kind == "RPP" and loaded == 0:
        return  # the second link passes a couple and no force
    driven = module.links[loaded]
    point = next(iter(mechanism.links[driven].points))
    load = {"link": driven, "at": point, "force": [30.0, -70.0], "moment": 11.0}
    mechanism = Mechanism(**{**mechanism.data(), "loads": {"F": load}})
    run, walk, found = angles(mechanism)
    b, c, d = module.joints
    # the force acts on the driven link in C, but by a slide through the outer pin of the two-force link
    acts_at, holder_at = (c if run.system.joints[c][0] == "revolute" else (b, d)[1 - loaded]), (b, d)[loaded]
    holder = next(link for link in run.system.joints[holder_at][1] if link != driven)
    place = walk.element(run.system.joints[acts_at][1][0], acts_at)
    reaction = run.solve(run.cycle.times(24)).reactions[c]

    def velocity(link: str) -> tuple[Array, Array]:
        twist = walk.motions[link].twist
        return twist.x - twist.w * place.y, twist.y + twist.w * place.x

    (x, y), (hx, hy) = velocity(driven), velocity(holder)
    x, y = x - hx, y - hy
    size = np.hypot(reaction.x, reaction.y) * np.hypot(x, y)
    good = size > 1e-6 * np.max(size)
    assert np.count_nonzero(good) > 12
    cosine = np.abs(reaction.x * x + reaction.y * y)[good] / size[good]
    expected = np.broadcast_to(np.cos(found["-".join(module.joints)]), size.shape)[good]
    np.testing.assert_allclose(cosine, expected, atol=1e-9)


def test_rows_name_the_positions() -> None:
    (row,) = [one for one in figures.report_figures(build(forwards(0.3, 1.0, 0.0))) if "pressure_angle" in one.name]
    assert (row.value, row.place) == ("-17.4576 … 17.4576", "at 90° and 270°")
    yoke = figures.report_figures(build(MODELS["Scotch yoke"]()))
    assert [one.place for one in yoke if "pressure_angle" in one.name] == ["everywhere"]
