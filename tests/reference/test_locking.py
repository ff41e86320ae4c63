"""Where friction locks: a closed form, and an independent homotopy on the Newton–Euler equations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import test_newton_euler as oracle

import trunnion
from brief import brief
from mechanisms import MODELS, Array, Data, build, findings, model, prismatic, revolute, slide, slider_crank
from reference import newton_euler
from trunnion import FrictionMethod, Mechanism, Status
from trunnion.results.attributes import summary_of
from trunnion.solve.run import prepare

ARM, GUIDE, LOAD = 0.15, 0.12, 40.0
CRITICAL = GUIDE / (2 * ARM)


def pushed_slider(coefficient: float, load: float = -LOAD, speed: float = 0.1) -> Mechanism:
    """A ram pushes a slider through a rod parallel to the guide, ARM beside its middle."""
    data: Data = {
        "links": {
            "ground": {"points": {"X": slide(0, ARM), "G": slide(0, 0)}},
            "ram": {"points": {"X": slide(0, 0), "P": [0.1, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.5, 0]}},
            "slider": {"points": {"Q": [0, ARM], "G": slide(0, 0)}},
        },
        "joints": {
            "X": prismatic("ground", "ram"),
            "P": revolute("ram", "rod"),
            "Q": revolute("rod", "slider"),
            "G": {**prismatic("ground", "slider"), "friction": coefficient, "guide": {"length": GUIDE}},
        },
        "drivers": {"X": {"speed": speed, "range": [0.0, 0.2 * np.sign(speed)]}},
        "loads": {"work": {"link": "slider", "at": "G", "force": [load, 0.0]}},
        "assembly": {"Q": [0.6, ARM]},
    }
    return Mechanism(**data)


@pytest.mark.parametrize("share", [0.5, 1 - 1e-6])
def test_below_the_critical_coefficient(share: float) -> None:
    """P = W/(1 − 2 f a/L), finite up to the brink."""
    result = brief(pushed_slider(share * CRITICAL), 7)
    assert np.all(result["status"] == Status.SOLVED)
    np.testing.assert_allclose(result["drive_effort"].values, LOAD / (1 - share), rtol=1e-9 / (1 - share) + 1e-12)
    assert np.all(result["friction_power"].sel(joint="G") > 0)


@pytest.mark.parametrize("excess", [1 + 1e-5, 10.0])
def test_above_the_critical_coefficient(excess: float) -> None:
    """Locked at the share 1/excess of the friction, found to 1e-6; NaN instead of the negative P of the formula."""
    mechanism = pushed_slider(excess * CRITICAL)
    run = prepare(mechanism)
    shares = [np.min(settled.share) for settled in run.solve(run.cycle.times(5)).settled]
    assert min(shares) == pytest.approx(1 / excess, abs=1e-6)
    result = trunnion.analyse(mechanism, 5)
    assert np.all(result["status"] == Status.LOCKED)
    for variable in ("drive_effort", "reaction_force", "friction_power", "drive_effort_lower", "power_residual"):
        assert np.all(np.isnan(result[variable])), variable
    assert np.all(np.isfinite(result["point_position"]))
    assert np.all(np.isfinite(result["point_velocity"]))
    (error,) = (row for row in findings(result) if row["severity"] == "error")
    assert error["code"] == "friction.locked"
    assert error["figures"]["at"] == "at every position"


@pytest.mark.parametrize("coefficient", [0.3 * CRITICAL, 3 * CRITICAL])
def test_a_load_that_helps_never_locks(coefficient: float) -> None:
    """Pulled along, the ram brakes: P = −W/(1 + 2 f a/L) for any coefficient."""
    result = brief(pushed_slider(coefficient, LOAD), 5)
    assert np.all(result["status"] == Status.SOLVED)
    np.testing.assert_allclose(result["drive_effort"].values, -LOAD / (1 + coefficient / CRITICAL), rtol=1e-9)


def test_successive_approximation_never_calls_a_locked_position_solved() -> None:
    """However long it iterates: it may diverge to infinity, but then it has not converged."""
    for limit in (20, 200, 5000):
        result = brief(pushed_slider(3 * CRITICAL), 3, FrictionMethod("successive-approximation", None, limit))
        assert np.all(result["status"] >= Status.NOT_CONVERGED), limit
        assert np.all(np.isnan(result["drive_effort"])), limit


# ---- homotopy on the oracle -----------------------------------------------------------------------------------

STEPS = oracle.STEPS
GRID = 120  # steps of the share from 0 to 1


def affine(run: Any, data: Data) -> tuple[list[str], Array, Array]:
    """Joints; reactions (position, joint, xym) without friction; and their change per unit friction of each joint."""
    time = oracle.times(run)
    ideal = prepare(run.system.mechanism.with_friction("off"))
    back, second = ideal.solve(time), oracle.accelerations(run, time)
    names = list(run.system.joints)

    def reactions(i: int, joints: dict[str, newton_euler.Joint]) -> Array:
        found = newton_euler.solve(oracle.bodies_at(ideal, data, back, second, i), joints, data["gravity"])
        return np.array([[*found.force[name], found.moment[name]] for name in names])

    start, slope = [], []
    for i in range(STEPS):
        joints = oracle.joints_at(ideal, back, i)
        zero = reactions(i, joints)
        start.append(zero)
        rows = []
        for name in names:
            one = newton_euler.Joint(**{**vars(joints[name]), "friction": 1.0})
            rows.append(reactions(i, {**joints, name: one}) - zero)
        slope.append(rows)
    return names, np.array(start), np.array(slope)


def independent_shares(run: Any, data: Data, coefficient: float, radius: float, guide: float) -> Array:
    """Share of the friction, of each position, at which the solution that starts frictionless ends; 1 if none."""
    names, start, slope = affine(run, data)
    walk = run.solve(oracle.times(run))
    kinds = [run.system.joints[name][0] for name in names]
    sign = np.array([np.broadcast_to(np.sign(walk.walk.speed(name)), (STEPS,)) for name in names]).T
    lever = np.where(np.array(kinds) == "revolute", radius, 1.0)
    axes = []
    for name, (_, (first, _)) in run.system.joints.items():
        axis = walk.walk.element(first, name)
        axes.append([np.broadcast_to(n, (STEPS,)) for n in (axis.c, axis.s)])
    c, s = np.moveaxis(np.array(axes), (0, 1, 2), (2, 0, 1))

    def normals(phi: Array) -> Array:
        reaction = start + np.einsum("pl,pljx->pjx", phi, slope)
        across = c * reaction[..., 1] - s * reaction[..., 0]
        ends = np.maximum(np.abs(across), 2 * np.abs(reaction[..., 2]) / guide)
        return np.where(np.array(kinds) == "revolute", np.hypot(reaction[..., 0], reaction[..., 1]), ends)

    def residual(phi: Array, share: Array) -> Array:
        return phi + share[:, None] * sign * coefficient * lever * normals(phi)

    def jacobian(phi: Array, share: Array) -> Array:
        scale = 1e-7 * (np.abs(phi).max(axis=1) + 1e-3)
        columns = []
        for k in range(len(names)):
            step = np.zeros_like(phi)
            step[:, k] = scale
            columns.append((residual(phi + step, share) - residual(phi - step, share)) / (2 * scale[:, None]))
        return np.stack(columns, axis=-1)

    phi, alive, reached = np.zeros((STEPS, len(names))), np.ones(STEPS, bool), np.zeros(STEPS)
    for k in range(1, GRID + 1):
        share = np.full(STEPS, k / GRID)
        new = phi.copy()
        for _ in range(8):
            if np.all((np.abs(residual(new, share)).max(axis=1) < 1e-10 * np.abs(new).max(axis=1))[alive]):
                break
            matrix = jacobian(new, share)
            matrix[~alive] = np.eye(len(names))
            move = np.linalg.solve(matrix, residual(new, share)[..., None])[..., 0]
            new = np.where(alive[:, None], new - move, new)
        size = np.abs(new).max(axis=1) + 1e-300
        good = np.abs(residual(new, share)).max(axis=1) < 1e-8 * size
        good &= np.linalg.det(jacobian(new, share)) > 0
        alive &= good
        phi = np.where(alive[:, None], new, phi)
        reached = np.where(alive, k / GRID, reached)
        if not alive.any():
            break
    return reached


HEAVY = {
    "four-bar": (1.0, 0.5, 0.4),
    "four-bar, other branch": (1.0, 0.5, 0.4),
    "slider-crank": (1.0, 0.3, 0.1),
    "inverted slider-crank": (1.0, 0.2, 0.1),
    "Scotch yoke": (0.4, 0.05, 0.4),
    "tangent drive": (0.5, 0.02, 0.3),
    "elliptic bar": (1.0, 0.2, 0.1),
    "class III": (0.5, 0.2, 0.4),
}


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", HEAVY)
def test_locked_positions(name: str) -> None:
    """The same positions lock, each at the same share, as by small steps on the equations of all links at once."""
    coefficient, radius, guide = HEAVY[name]
    options = {"friction": coefficient, "radius": radius, "guide": guide}
    data = model(MODELS[name](), **options)
    run = prepare(build(MODELS[name](), **options))
    expected = independent_shares(run, data, coefficient, radius, guide)  # good to one step of the grid
    back = run.solve(oracle.times(run))
    found = np.min([np.broadcast_to(settled.share, (STEPS,)) for settled in back.settled], axis=0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2 / GRID)
    assert np.any(expected < 1), "this case is to have locked positions"
    free = found >= 1
    for joint, force in back.friction.items():
        assert np.all(np.isfinite(np.broadcast_to(force, (STEPS,))[free])), joint


def jamming_piston() -> Mechanism:
    """A short rod that presses a piston with friction aside."""
    data = slider_crank(0.3, 0.5, 0.0)
    data["joints"]["C"]["friction"] = 1.6
    data["loads"] = {"press": {"joint": "C", "resisting_force": "100 N"}}
    data["drivers"] = {"A": {"speed": 6.0}}
    return build(data, friction=None)


def toward_its_dead_centre() -> Mechanism:
    """A piston that turns its crank against a torque, up to where rod and crank are in line."""
    data = slider_crank(offset=0.0)
    data["drivers"] = {"C": {"speed": 0.1, "range": [1.1, 1.35]}}
    data["loads"] = {"brake": {"joint": "A", "resisting_torque": "10 N m"}}
    return build({**data, "assembly": {"B": [0.1, 0.28]}}, friction=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mechanism", "note"),
    [
        (jamming_piston(), "no bound: it locks there"),
        (toward_its_dead_centre(), "no bound"),
    ],
    ids=["locks", "dead centre"],
)
def test_efforts_and_reactions_have_no_maximum_where_they_grow_without_bound(mechanism: Mechanism, note: str) -> None:
    figures = {figure.name: figure for figure in summary_of(trunnion.analyse(mechanism, 12))}
    driver = next(iter(mechanism.drivers))
    for name in (f"{driver}.effort_max", "B.reaction_max"):
        assert (figures[name].value, figures[name].note) == (None, note)
