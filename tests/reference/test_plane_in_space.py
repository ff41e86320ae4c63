"""Planar mechanisms drawn in space, held three times more than needed in every loop: the planar answer is theirs.

With loads in the plane the smallest reactions that balance have nothing across it: both ends of a bearing carry
half the force each and its friction is the planar f r |F|; a guide's ends are those of the planar guide.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import MODELS, Data, build, model
from trunnion.solve.run import prepare

NAMES = [
    name
    for name, data in MODELS.items()
    if "gears" not in data() and "springs" not in data() and len(data()["links"]) <= 6
]
STEPS = 16


def raised(data: Data) -> Data:
    """The same model in space: z across the plane, pins along z; inertia about x and y is that of a thin plate."""

    def point(stated: Any, joint: dict[str, Any] | None) -> Data:
        at = stated["at"] if isinstance(stated, dict) else stated
        found: Data = {"at": [*at, 0.0]}
        if joint and joint["type"] == "prismatic":
            return {**found, "axis": [*stated["axis"], 0.0], "x": [0, 0, 1]}
        return {**found, "axis": [0, 0, 1], "x": [1, 0, 0]} if joint else found

    links: Data = {}
    for name, link in data["links"].items():
        points = {p: point(stated, data["joints"].get(p)) for p, stated in link["points"].items()}
        links[name] = {**link, "points": points}
        if "centre" in link:
            links[name]["centre"] = [*link["centre"], 0.0]
        if "inertia" in link:
            links[name]["inertia"] = {"xx": link["inertia"] / 2, "yy": link["inertia"] / 2, "zz": link["inertia"]}
    loads: Data = {}
    for name, load in data.get("loads", {}).items():
        loads[name] = dict(load)
        if "force" in load:
            loads[name]["force"] = [*load["force"], 0.0]
        if "moment" in load:
            loads[name]["moment"] = [0.0, 0.0, load["moment"]]
    defaults = data["joint_defaults"]
    hints = {name: [*hint, 0.0] if isinstance(hint, list) else hint for name, hint in data.get("assembly", {}).items()}
    return {
        **data,
        "space": "spatial",
        "over_constraint": "minimum-norm",
        "gravity": [*data["gravity"], 0.0],
        "links": links,
        "loads": loads,
        "assembly": hints,
        "joint_defaults": {**defaults, "pin": {**defaults["pin"], "bearing": 0.05}},
    }


@pytest.mark.spread(1)
@pytest.mark.parametrize("friction", [None, 0.12])
@pytest.mark.parametrize("name", NAMES)
def test_planar_mechanism_in_space(name: str, friction: float | None) -> None:
    """Motion to 1e-10, forces to 1e-8 of the largest; nothing across the plane, where friction is refused for that."""
    data = model(MODELS[name](), friction=friction)
    flat = brief(build(MODELS[name](), friction=friction), STEPS)
    space = brief(trunnion.Mechanism(trunnion=1, **raised(data)), STEPS, refuse=False)
    np.testing.assert_array_equal(flat.status.values, space.status.values)
    points = [p for p in flat.point.values if p in space.point.values]
    for what, limit in (("position", 1e-10), ("velocity", 1e-9), ("acceleration", 1e-8)):
        one, two = (result[f"point_{what}"].sel(point=points).values for result in (flat, space))
        scale = max(1.0, float(np.nanmax(np.abs(one))))
        np.testing.assert_allclose(two[:, :2], one, rtol=0, atol=limit * scale, err_msg=what)
        np.testing.assert_allclose(two[:, 2], 0, rtol=0, atol=limit * scale, err_msg=what)
    scale = float(np.nanmax(np.abs(flat.reaction_force.values)))
    force = space.reaction_force.sel(joint=flat.joint.values).values
    np.testing.assert_allclose(force[:, :2], flat.reaction_force.values, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(force[:, 2], 0, rtol=0, atol=1e-8 * scale)
    moment = space.reaction_moment.sel(joint=flat.joint.values).values
    np.testing.assert_allclose(moment[:, 2], flat.reaction_moment.values, rtol=0, atol=1e-8 * scale)
    np.testing.assert_allclose(moment[:, :2], 0, rtol=0, atol=1e-8 * scale)
    for what in ("friction_torque", "friction_force", "drive_effort", "friction_power"):
        one, two = flat[what].values, space[what].values
        np.testing.assert_allclose(two, one, rtol=0, atol=1e-8 * scale, err_msg=what)
    if friction:
        assert np.nanmax(np.abs(flat.friction_power.values)) > 1e-3


def test_a_joint_is_at_rest_by_one_rule() -> None:
    """In the plane as in space: below 1e-10 of both links' spins and the pace, times the size where it slides."""
    name = next(name for name in NAMES if any(one["type"] == "prismatic" for one in MODELS[name]()["joints"].values()))
    data = model(MODELS[name](), friction=0.1)
    for mechanism in (build(MODELS[name](), friction=0.1), trunnion.Mechanism(trunnion=1, **raised(data))):
        run = prepare(mechanism)
        walk = run.walk(run.cycle.times(STEPS))
        for joint, (kind, links) in walk.system.joints.items():
            turn = 1e-10 * (sum(np.abs(walk.spins[link]) for link in links) + walk.pace)
            np.testing.assert_allclose(walk.noise(joint, turns=True), turn, rtol=1e-14)
            np.testing.assert_allclose(walk.noise(joint, turns=False), turn * walk.size, rtol=1e-14)
            turns = kind == "revolute"
            rate = np.broadcast_to(walk.rates(joint)[0 if turns else 1], (STEPS,))
            still = np.broadcast_to(walk.still(joint, turns), (STEPS,))
            np.testing.assert_array_equal(still, np.abs(rate) <= walk.noise(joint, turns))


def coupled_wheels(third: tuple[float, float], stiffness: dict[str, float] | None = None) -> Data:
    """Three equal cranks on one coupling rod: mobility 0 by the count, 1 by rank."""
    feet = {"A": (0.0, 0.0), "B": (1.2, 0.0), "C": third}
    pins = dict(zip(feet, "DEF", strict=True))
    links: Data = {"ground": {"points": {name: list(place) for name, place in feet.items()}}}
    joints: Data = {}
    for name, pin in pins.items():
        links[f"wheel-{name}"] = {"points": {name: [0, 0], pin: [0.3, 0]}, "mass": 20.0, "inertia": 0.5}
        joints[name] = {"type": "revolute", "links": ["ground", f"wheel-{name}"]}
        joints[pin] = {"type": "revolute", "links": [f"wheel-{name}", "rod"]}
    rod = {pin: list(feet[name]) for name, pin in pins.items()}
    links["rod"] = {"points": rod, "mass": 30.0, "inertia": 8.0, "centre": [1.0, 0.1]}
    for name, radial in (stiffness or {}).items():
        joints[name]["stiffness"] = {"radial": radial}
    return {
        "over_constraint": "minimum-norm",
        "gravity": [0, -9.81],
        "links": links,
        "joints": joints,
        "joint_defaults": {"pin": {"radius": 0.02}, "friction": 0.05},
        "drivers": {"A": {"speed": 10.0, "range": [0.4, 2.6]}},
        "loads": {"pull": {"joint": "C", "resisting_torque": 100.0, "useful": True}},
    }


@pytest.mark.slow
@pytest.mark.parametrize("third", [(2.5, 0.0), (1.7, 0.9)])
def test_three_wheels_on_a_rod(third: tuple[float, float]) -> None:
    """In the plane as in space, where everything that holds it across the plane carries nothing."""
    data = coupled_wheels(third)
    flat = trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), STEPS)
    space = trunnion.analyse(trunnion.Mechanism(trunnion=1, **raised(data)), STEPS)
    np.testing.assert_allclose(flat.drive_effort.values, space.drive_effort.values, rtol=1e-9)
    forces = flat.reaction_force.values
    atol = 1e-9 * np.max(np.abs(forces))
    np.testing.assert_allclose(space.reaction_force.values[:, :2], forces, rtol=0, atol=atol)
    assert float(np.max(np.abs(flat.power_residual))) < 1e-10
    assert {"mobility.redundant_least", "mobility.friction_open"} <= {one.code for one in flat.trunnion.findings}
    rest = {key: value for key, value in data.items() if key != "over_constraint"}
    with pytest.raises(trunnion.MechanismError, match="over_constraint: minimum-norm"):
        trunnion.analyse(trunnion.Mechanism(trunnion=1, **rest), STEPS)


def test_three_wheels_share_their_load_by_stiffness() -> None:
    """Without friction: forces of the one self-stress shift the energy nowhere, Σ F · S / k = 0."""
    stiffness = dict(zip("ABCDEF", (2e7, 5e6, 8e6, 3e7, 1e6, 4e6), strict=True))
    data = {**coupled_wheels((1.7, 0.9), stiffness), "joint_defaults": {}}
    result = trunnion.analyse(trunnion.Mechanism(trunnion=1, **data), STEPS)
    place = {name: result.point_position.sel(point=name).values for name in result.point.values}
    for step in range(STEPS):
        pins = np.array([place[f"rod.{name}"][:, step] for name in "DEF"])
        crank = place["wheel-A.D"][:, step] - place["wheel-A.A"][:, step]
        unit = crank / np.linalg.norm(crank)  # a massless crank passes on what is along it; the driven one anything
        # forces of the cranks on the rod that balance: a along unit at E and F, any at D
        matrix = np.array(
            [
                [1.0, 0.0, unit[0], unit[0]],
                [0.0, 1.0, unit[1], unit[1]],
                [
                    -pins[0][1],
                    pins[0][0],
                    pins[1][0] * unit[1] - pins[1][1] * unit[0],
                    pins[2][0] * unit[1] - pins[2][1] * unit[0],
                ],
            ]
        )
        null = np.linalg.svd(matrix)[2][-1]
        own = np.array([null[:2], null[2] * unit, null[3] * unit])
        forces = np.array([result.reaction_force.sel(joint=name).values[:, step] for name in "ABCDEF"])
        stresses = np.vstack([own, own])
        energy = [forces[i] @ stresses[i] / stiffness[name] for i, name in enumerate("ABCDEF")]
        assert abs(sum(energy)) < 1e-9 * max(abs(part) for part in energy)
