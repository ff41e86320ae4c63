"""Where friction locks: closed forms, a homotopy on the Newton–Euler equations, margins, multiples, the way back."""

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import DURANGO, MODELS, build, findings, five_bar, four_bar, model, slide, slider_crank
from mechanisms_parts import joined
from mechanisms_space import cardan, rssr
from reference.maximal_space import Drive, in_planes, pose_of
from reference.newton_euler import loads_of_bearings
from reference.space_oracle import Oracle
from trunnion import FrictionMethod, Mechanism, Status, locking
from trunnion.cycle.locking_course import multiples_at
from trunnion.results.attributes import summary_of
from trunnion.solve.backward import status_of
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import prepare
from trunnion.solve.walk_kernel import WalkKernel

ARM, GUIDE, LOAD = 0.15, 0.12, 40.0
CRITICAL = GUIDE / (2 * ARM)


def pushed_slider(coefficient, load=-LOAD):
    """A ram pushes a slider through a rod parallel to the guide, ARM beside its middle."""
    data = {
        "links": {
            "ground": {"points": {"X": slide(0, ARM), "G": slide(0, 0)}},
            "ram": {"points": {"X": slide(0, 0), "P": [0.1, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.5, 0]}},
            "slider": {"points": {"Q": [0, ARM], "G": slide(0, 0)}},
        },
        "joints": joined(
            "ground =X= ram -P- rod -Q- slider, ground =G= slider",
            G={"friction": coefficient, "guide": {"length": GUIDE}},
        ),
        "drivers": {"X": {"speed": 0.1, "range": [0.0, 0.2]}},
        "loads": {"work": {"link": "slider", "at": "G", "force": [load, 0.0]}},
        "assembly": {"Q": [0.6, ARM]},
    }
    return Mechanism(**data)


@pytest.mark.parametrize(
    ("load", "share"),
    [(-LOAD, 0.5), (-LOAD, 1 - 1e-6), (LOAD, 0.3), (LOAD, 3.0)],
    ids=["half", "brink", "helps", "rough"],
)
def test_below_the_critical_coefficient(load, share):
    """P = W/(1 − 2 f a/L), finite up to the brink; pulled along the ram brakes, P = −W/(1 + 2 f a/L) for any f."""
    result = brief(pushed_slider(share * CRITICAL, load), 7)
    assert np.all(result["status"] == Status.SOLVED)
    rest = 1 + np.sign(load) * share
    np.testing.assert_allclose(result["drive_effort"].values, -load / rest, rtol=1e-9 / min(rest, 1.0) + 1e-12)
    assert np.all(result["friction_power"].sel(joint="G") > 0)


@pytest.mark.parametrize("excess", [1 + 1e-5, 10.0])
def test_above_the_critical_coefficient(excess):
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


def test_successive_approximation_never_calls_a_locked_position_solved():
    """However long it iterates: it may diverge to infinity, but then it has not converged."""
    for limit in (20, 200, 5000):
        result = brief(pushed_slider(3 * CRITICAL), 3, FrictionMethod("successive-approximation", None, limit))
        assert np.all(result["status"] >= Status.NOT_CONVERGED), limit
        assert np.all(np.isnan(result["drive_effort"])), limit


# ---- homotopy on the oracle -----------------------------------------------------------------------------------

STEPS = 24
GRID = 120  # steps of the share from 0 to 1


def independent_shares(run, data, guide):
    """Share of the friction, of each position, at which the solution that starts frictionless ends; 1 if none."""
    other, time = Oracle(in_planes(data)), (np.arange(STEPS) + 0.37) / STEPS * run.cycle.duration
    walk = run.walk(time)
    drives = {name: run.system.drive(run.values, name, time) for name in other.drivers}
    felt = []
    for i in range(STEPS):
        home = {link: pose_of(motion.frame, i) for link, motion in walk.motions.items()}
        drive = {
            name: Drive(*(float(np.broadcast_to(n, STEPS)[i]) for n in numbers)) for name, numbers in drives.items()
        }
        motions = other.move(home, drive)
        rubbing = [other.rubbing(motions, name) for name in run.system.joints]
        felt.append(loads_of_bearings(other.bodies(motions), other.joints_at(motions, {}), rubbing, other.gravity))
    start, slope = (np.array(parts) for parts in zip(*felt, strict=True))
    slides = np.array([joint.type == "prismatic" for joint in run.system.joints.values()])
    coefficients = np.array([other.coefficient(name) for name in run.system.joints])

    def residual(sizes, share):
        load = start + np.einsum("pjwl,pl->pjw", slope, sizes)
        force, moment = (np.linalg.norm(part, axis=-1) for part in np.split(load, 2, axis=-1))
        normal = np.where(slides, np.maximum(force, 2 * moment / guide), force)
        return np.asarray(sizes - share * coefficients * normal)

    def jacobian(sizes, share):
        scale = 1e-7 * (np.abs(sizes).max(axis=1, keepdims=True) + 1e-3)
        steps = scale * np.eye(len(slides))[:, None]  # (friction, position, friction)
        ends = [(residual(sizes + step, share), residual(sizes - step, share)) for step in steps]
        return np.stack([(after - before) / (2 * scale) for after, before in ends], axis=-1)

    sizes, alive, reached = np.zeros((STEPS, len(slides))), np.ones(STEPS, bool), np.zeros(STEPS)
    for share in np.arange(1, GRID + 1) / GRID:
        new = sizes.copy()
        for _ in range(8):
            if np.all((np.abs(residual(new, share)).max(axis=1) < 1e-10 * np.abs(new).max(axis=1))[alive]):
                break
            matrix = jacobian(new, share)
            matrix[~alive] = np.eye(len(slides))
            move = np.linalg.solve(matrix, residual(new, share)[..., None])[..., 0]
            new = np.where(alive[:, None], new - move, new)
        alive &= np.abs(residual(new, share)).max(axis=1) < 1e-8 * (np.abs(new).max(axis=1) + 1e-300)
        alive &= np.linalg.det(jacobian(new, share)) > 0
        sizes = np.where(alive[:, None], new, sizes)
        reached = np.where(alive, share, reached)
        if not alive.any():
            break
    return reached


HEAVY = {
    "four-bar": (1.0, 0.5, 0.4), "four-bar, other branch": (1.0, 0.5, 0.4), "slider-crank": (1.0, 0.3, 0.1),
    "inverted slider-crank": (1.0, 0.2, 0.1), "Scotch yoke": (0.4, 0.05, 0.4), "tangent drive": (0.5, 0.02, 0.3),
    "elliptic bar": (1.0, 0.2, 0.1), "class III": (0.5, 0.2, 0.4),
}  # fmt: skip


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", HEAVY)
def test_locked_positions(name):
    """The same positions lock, each at the same share, as by small steps on the equations of all links at once."""
    coefficient, radius, guide = HEAVY[name]
    options = {"friction": coefficient, "radius": radius, "guide": guide}
    data = model(MODELS[name](), **options)
    run = prepare(build(MODELS[name](), **options))
    expected = independent_shares(run, data, guide)  # good to one step of the grid
    back = run.solve((np.arange(STEPS) + 0.37) / STEPS * run.cycle.duration)
    found = np.min([np.broadcast_to(settled.share, (STEPS,)) for settled in back.settled], axis=0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2 / GRID)
    assert np.any(expected < 1), "this case is to have locked positions"
    free = found >= 1
    for joint, force in back.friction.items():
        assert np.all(np.isfinite(np.broadcast_to(force, (STEPS,))[free])), joint


@pytest.mark.slow
@pytest.mark.parametrize("locks", [True, False])
def test_efforts_and_reactions_have_no_maximum_where_they_grow_without_bound(locks):
    """A short rod that presses a piston with friction aside; a piston that turns its crank up to its dead centre."""
    if locks:
        data = slider_crank(0.3, 0.5, 0.0)
        data["joints"]["C"]["friction"] = 1.6
        data |= {"loads": {"press": {"joint": "C", "resisting_force": "100 N"}}, "drivers": {"A": {"speed": 6.0}}}
    else:
        data = slider_crank(offset=0.0) | {"assembly": {"B": [0.1, 0.28]}}
        data["drivers"] = {"C": {"speed": 0.1, "range": [1.1, 1.35]}}
        data["loads"] = {"brake": {"joint": "A", "resisting_torque": "10 N m"}}
    mechanism = build(data, friction=None if locks else 0.1)
    figures = {figure.name: figure for figure in summary_of(trunnion.analyse(mechanism, 12))}
    for name in (f"{next(iter(mechanism.drivers))}.effort_max", "B.reaction_max"):
        assert (figures[name].value, figures[name].note) == (None, "no bound" + ": it locks there" * locks)


MOMENTS, MECHANISMS, ALONE = 24, 20, slice(None, None, 5)
SAME = 1e-9
NEARLY = 1e-3  # of the margin, below and above which it is looked whether a position locks


def pressed_slider(rng):
    """A light slider-crank with a load across its guide, whose contact changes ends as the friction grows."""
    r = 0.03 * rng.uniform(0.7, 1.3)
    data = slider_crank(r, r * rng.uniform(2.5, 5.0), r * rng.uniform(-0.3, 0.3))
    for link in ("crank", "rod", "piston"):
        data["links"][link] = {"points": data["links"][link]["points"]}
    aside = [rng.uniform(-0.02, 0.04), rng.uniform(-0.02, 0.02)]
    data["links"]["piston"]["points"] |= {"C": {"at": [0, 0], "axis": [1, 0]}, "H": aside}
    data["loads"] = {
        "work": {"joint": "C", "resisting_force": rng.uniform(40.0, 150.0)},
        "across": {"link": "piston", "at": "H", "force": [0.0, -60.0]},
    }
    return build(data, friction=0.25, radius=0.006 * rng.uniform(0.5, 1.5), guide=0.04)


def crank_and_rocker(rng):
    data = four_bar(*np.array([0.3, 0.9, 0.7, 1.0]) * rng.uniform(0.95, 1.05, 4))
    data["loads"]["work"] = {"joint": "D", "resisting_torque": rng.uniform(5.0, 60.0)}
    return build(data, friction=rng.uniform(0.4, 0.6), radius=rng.uniform(0.08, 0.15))


def ball_rods(rng):
    data = rssr(friction=rng.uniform(0.3, 0.6)).data
    for name, joint in data["joints"].items():
        joint["pin"] = {"radius": rng.uniform(0.01, 0.02), **({"bearing": 0.02} if name in "AD" else {})}
    data["loads"]["brake"]["resisting_torque"] = rng.uniform(0.5, 4.0)
    return Mechanism.model_validate(data)


def shafts(rng):
    """RCCC: a Cardan joint with errors."""
    data = cardan(rng.uniform(0.04, 0.08), rng.uniform(10.0, 40.0), rng.uniform(0.05, 0.5), rng.uniform(0.5, 5.0))
    data["joint_defaults"]["friction"] = rng.uniform(0.3, 0.5)
    return Mechanism.model_validate(data)


DRAWN = {
    "slider-crank": pressed_slider, "four-bar": crank_and_rocker, "RSSR": ball_rods, "RCCC": shafts,
    # the ram below, at coefficients of which it runs, one group locks or both
    "two groups": lambda rng: ram(rng.uniform(0.4, 2.0), rng.choice([0.0, 400.0])),
}  # fmt: skip
CASES = [pytest.param(name, seed, id=f"{name}-{seed}") for name in DRAWN for seed in range(MECHANISMS)]


def prepared(name, seed):
    return prepare(DRAWN[name](np.random.default_rng(seed)))


def margins(run, time):
    with np.errstate(all="ignore"):
        back = run.solve(time, method=FrictionMethod(margin_up_to=10.0))
        return np.broadcast_to(locking_margin(back), time.shape).copy()


def locked(run, time, multiple):
    with np.errstate(all="ignore"):
        back = run.solve(time, method=FrictionMethod(multiple=multiple))
        return np.broadcast_to(np.less(back.share, 1.0), time.shape)


@pytest.mark.sample(10)
@pytest.mark.spread(4, "slider-crank-3", "slider-crank-9")
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_a_margin_is_where_it_locks_whatever_is_solved_with_it(name, seed):
    run = prepared(name, seed)
    time = run.cycle.times(MOMENTS)
    margin = margins(run, time)
    np.testing.assert_array_equal([margins(run, moment)[0] for moment in time[ALONE, None]], margin[ALONE])
    finite = np.isfinite(margin)
    assert finite.any()
    assert not locked(run, time[finite], (1 - NEARLY) * margin[finite]).any()
    assert locked(run, time[finite], (1 + NEARLY) * margin[finite]).all()


@pytest.mark.sample(6)
@pytest.mark.spread(2)
@pytest.mark.parametrize(("name", "seed"), CASES)
def test_the_compiled_margin_is_the_same(name, seed):
    pytest.importorskip("llvmlite")
    run = prepared(name, seed)
    time = run.cycle.times(MOMENTS)
    kernel = WalkKernel(run, {"margin": locking_margin}, method=FrictionMethod(margin_up_to=10.0))
    compiled = kernel.curves(run.values, time)[0]["margin"][0]
    np.testing.assert_allclose(compiled, margins(run, time), rtol=SAME)


POSITIONS = 24


def ram(coefficient, aside=0.0):
    """A crank with its block on a lever, which pushes a ram by a rod. aside: load on the lever alone, N."""
    axis = slide(0, 0)
    return Mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "C": [0, -0.08], "G": slide(-0.1, 0.1)}},
            "crank": {"points": {"A": [0, 0], "B": [0.03, 0]}},
            "lever": {"points": {"C": [0, 0], "D": [0.18, 0], "F": axis}},
            "rod": {"points": {"D": [0, 0], "E": [0.1, 0]}},
            "block": {"points": {"B": [0, 0], "F": axis}},
            "slide": {"points": {"E": [0, 0], "G": axis}},
        },
        joints=joined(
            "ground -A- crank, ground -C- lever -D- rod, lever =F= block, crank -B- block, ground =G= slide, "
            "rod -E- slide"
        ),
        assembly={"D": [0, 0.1], "F": 0.11, "B": [0, 0.03], "E": [-0.1, 0.1]},
        drivers={"A": {"speed": 6.0, "start": 1.6}},
        loads={
            "work": {"joint": "G", "resisting_force": 150.0},
            "aside": {"link": "lever", "at": "D", "force": [aside, -2 * aside]},
        },
        joint_defaults={"friction": coefficient, "pin": {"radius": 0.008}, "guide": {"length": 0.04}},
    )


@pytest.mark.spread(1)
@pytest.mark.parametrize(("coefficient", "aside"), [(0.4, 0.0), (2.0, 400.0)])
def test_below_the_margin_nothing_locks_and_above_it_something_does(coefficient, aside):
    """Whether it runs, one group locks or both, and whatever loads the inner one beside the outer."""
    found = brief(ram(coefficient, aside), POSITIONS)["locking_margin"].values
    times = float(np.nanmin(found)) * coefficient
    assert 0.4 < times < 4.0
    for multiple, expected in ((1 - 1e-4, False), (1 + 1e-4, True)):
        status = brief(ram(multiple * times, aside), POSITIONS)["status"].values
        assert np.any(status == Status.LOCKED) == expected


@pytest.mark.slow
def test_joints_of_a_group_without_loads_have_no_critical_multiple():
    found = locking(ram(2.0), POSITIONS)
    locked = found["status"].values == Status.LOCKED
    for joint, unknown in (("E", False), ("B", True)):
        assert np.all(np.isnan(found["critical_multiple"].sel(joint=joint).values[locked]) == unknown)


@pytest.mark.parametrize(("arm", "coefficient"), [(0.1, 0.2), (0.3, 0.2), (0.3, 0.5), (0.45, 0.6)])
def test_drawer_driven_backward(arm, coefficient):
    """A slide driven along its middle against a load beside it: N₁ + N₂ = 2 F a/L, so η = 1/(1 + 2 f a/L) forward and
    1 − 2 f a/L backward: it holds itself from f = L/2a."""
    mechanism = Mechanism(
        links={"ground": {"points": {"S": slide(0, 0)}}, "block": {"points": {"S": slide(0, 0), "P": [0, arm]}}},
        joints=joined("ground =S= block", S={"guide": {"length": 0.3}, "friction": coefficient}),
        drivers={"S": {"speed": 0.1, "range": [0, 0.2]}},
        loads={"weight": {"link": "block", "at": "P", "force": [-50.0, 0], "useful": True}},
    )
    result = trunnion.analyse(mechanism, 20)
    loss = 2 * coefficient * arm / 0.3
    assert float(result["efficiency"]) == pytest.approx(1 / (1 + loss), rel=1e-12)
    found = locking(mechanism, 20)
    np.testing.assert_allclose(found["drive_effort_reverse"], 50.0 * (1 - loss), rtol=1e-12, atol=1e-12)
    (row,) = [row for row in summary_of(result) if row.name == "efficiency_reverse"]
    assert row.value == pytest.approx(1 - loss, rel=1e-12)
    assert (row.note == "self-locking") == (loss >= 1)


FRICTIONAL = {
    "slider-crank": (lambda: slider_crank(0.3, 0.5, 0.1), {"friction": 0.35, "guide": 0.06, "radius": 0.05}),
    "five-bar": (five_bar, {"friction": 0.5, "radius": 0.15}),
    "four-bar": (four_bar, {"friction": 0.5, "radius": 0.12}),
}


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", FRICTIONAL)
def test_critical_multiples_are_where_it_locks(name):
    """Just below it runs, just above it is locked: one joint's coefficient changed, away from reversals."""
    data, options = FRICTIONAL[name]
    steps, coefficient = 12, options["friction"]
    run = prepare(build(data(), **options))
    time = run.cycle.times(steps) + 0.1 * run.cycle.duration / steps
    found = multiples_at(run, time, MARGIN)
    factors = np.array([1 - 1e-6, 1 + 1e-6])
    checked = 0
    for joint, multiple in found.items():
        at = np.flatnonzero(np.isfinite(multiple) & (multiple > 0))[::3]
        stated = float(coefficient) * multiple[at][:, None] * factors
        whole = model(data(), **options)
        whole["joints"][joint]["friction"] = coefficient
        run = prepare(Mechanism(**whole))
        values = run.system.mechanism.parameter_set.evaluate(
            {f"joints.{joint}.friction.coefficient": stated.reshape(-1, 1)}
        )
        status = status_of(run.solve(np.repeat(time[at], 2)[:, None], values), (stated.size, 1)).reshape(stated.shape)
        for k, position in enumerate(at):
            assert (status[k] == Status.LOCKED).tolist() == [False, True], (joint, position, multiple[position])
            checked += 2
    assert checked >= 6


@pytest.mark.slow
def test_locking_says_nothing_where_there_is_no_answer():
    """Positions that cannot be assembled have no margin and no multiple."""
    found = locking(build(four_bar(2.0, 1.5, 1.5, 4.0)), 36)
    gone = found["status"].values == Status.NOT_ASSEMBLED
    assert np.any(gone)
    assert np.any(~gone)
    for name in ("locking_margin", "critical_multiple"):
        assert np.all(np.isnan(found[name].values[..., gone]))
        assert not np.any(np.isnan(found[name].values[..., found["status"].values < Status.NOT_CONVERGED]))


@pytest.mark.slow
def test_what_locks_between_the_positions_is_found():
    """From about 151° to 180°, of which 12 positions have none: the range and the share are those of many positions."""
    model = trunnion.read(DURANGO.parent / "toleranced-fourbar.yaml")
    model = model.with_values({"joint_defaults.friction.coefficient": 4.0})
    few, many = (trunnion.analyse(model, steps) for steps in (12, 360))
    assert not np.any(few["status"] == Status.LOCKED)
    found, expected = ([row for row in findings(result) if row["code"] == "friction.locked"] for result in (few, many))
    assert [one["where"] for one in found] == [one["where"] for one in expected]
    for key in ("share", "whole"):
        assert found[0]["figures"][key] == pytest.approx(expected[0]["figures"][key], rel=1e-3)
    assert found[0]["figures"]["decides"] == expected[0]["figures"]["decides"]
