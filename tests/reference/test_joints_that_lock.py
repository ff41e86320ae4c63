"""Joints that lock in motion beside others that move on, several accelerations, and the rest of all free drivers."""

import itertools
import json

import clarabel
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.sparse import csc_matrix

from mechanisms_parts import joined
from timed import beside, wheel
from trunnion.dynamics.simulate import simulate
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import summary_of

G = 9.81
AXIS = {"at": [0, 0], "axis": [1, 0]}


def events(data):
    """Kind, joint, time, s, and figure of all events."""
    rows = json.loads(data.attrs["events"])
    return [(kind, of, float(time), figure)
            for (kind, of, figure, *_), time in zip(rows, data.event_time.values, strict=True)]  # fmt: skip


def findings(data):
    return {one["code"]: one["figures"] for one in json.loads(data.attrs["findings"])}


# ---- blocks on each other -------------------------------------------------------------------------------------


def stack(masses, rough, speeds, guide=1e3, **more):
    """Blocks a, b … on each other, each free to slide on the one below, in a guide so long that it never tilts."""
    names = "ABCD"[: len(masses)]
    bodies = ["ground", *names.lower()]
    points = [dict.fromkeys(names[max(k - 1, 0) : k + 1], AXIS) for k in range(len(bodies))]
    data = {
        "links": {body: {"points": points[k], **({"mass": masses[k - 1]} if k else {})}
                  for k, body in enumerate(bodies)},
        "joints": {name: {"type": "prismatic", "links": bodies[k : k + 2], "friction": rough[k],
                          "guide": {"length": guide}} for k, name in enumerate(names)},
        "drivers": {name: {"speed": 1, "range": [-50, 50], "free": True, "initial": {"coordinate": 0, "speed": speed}}
                    for name, speed in zip(names, speeds, strict=True)},
    }  # fmt: skip
    return Mechanism(**{"gravity": [0, -G], **data, **more})


LOW, ARM, GUIDE, F = 2.0, 0.3, 0.2, 0.5
JAM = 2 * F * ARM / GUIDE  # friction per inertia of what slides with its mass centre beside the guide: above 1


def jamming(force, upper=0.0, gravity=0.0, above=-1.0, alone=False):
    """A slider with its mass centre beside its guide, pushed along it, and a block that slides on it, if not alone."""
    count = 1 if alone else 2
    data = stack((LOW, 1.0)[:count], (F, upper)[:count], (1.0, above)[:count], gravity=[0, -gravity],
                 loads={"push": {"link": "a", "at": "A", "force": [force, 0]}}).data()  # fmt: skip
    data["links"]["a"]["centre"], data["joints"]["A"]["guide"] = [0, ARM], {"length": GUIDE}
    return Mechanism(**data)


@pytest.mark.slow
@pytest.mark.parametrize("alone", [False, True])
def test_a_slider_jams_where_its_push_turns_round(alone):
    """m q̈ + κ m |q̈| = T with κ > 1: pushed ahead q̈ = T/(m (1 + κ)); braked there is no q̈, and it stops at once; then
    it is pushed back. A block on it, without friction, keeps its momentum: it stands still in space all the time."""
    data = simulate(jamming("1 N - time/(1 s)*2 N", alone=alone), 1.0, 8)
    mass, half, time = LOW * (1 + JAM), 0.5, data.time.values
    (lock, back) = events(data)
    lost = 0.5 * LOW * (1.0 + half**2 / mass) ** 2
    assert lock == ("lock", "A", pytest.approx(half, abs=1e-8), pytest.approx(lost, rel=1e-9))
    assert back[:2] == ("break-away", "A")
    known, rates = time != half, data.drive_rate.values
    expected = np.where(time < half, 1 + (time - time**2) / mass, -((time - half) ** 2) / mass)
    assert rates[0][known] == pytest.approx(expected[known], abs=1e-9)
    assert alone or rates.sum(axis=0)[known] == pytest.approx(0.0, abs=1e-9)
    assert float(abs(data.energy_residual).max()) < 1e-9
    assert float(data.work_friction[-1]) > lost
    assert findings(data)["simulate.locks"]["joints"] == ["A"]
    assert findings(data)["simulate.locks"]["time"] == pytest.approx(half, abs=1e-8)
    assert findings(data)["simulate.several_accelerations"]["time"] == 0.0  # also T/(m (1 − κ)) obeys


@pytest.mark.slow
def test_what_sticks_to_a_slider_that_jams_is_torn_away():
    """Braked by more than its friction at low accelerations, the slider has no acceleration, and jams; the block that
    stuck to it slides on with the speed that it had, and with its own friction."""
    data = simulate(jamming("-200 N", 0.2, G, 0.0), 0.05, 10)
    lock = next(event for event in events(data) if event[0] == "lock")
    assert lock == ("lock", "A", 0.0, pytest.approx(0.5 * LOW, rel=1e-9))
    assert float(data.drive_rate[1, 0]) == pytest.approx(1.0, abs=1e-9)
    over = data.drive_rate.values.sum(axis=0)  # speed in space
    assert over == pytest.approx(1.0 - 0.2 * G * data.time.values, abs=1e-8)
    assert float(abs(data.energy_residual).max()) < 1e-8


LOWER, UPPER, STIFF = 2.0, 1.0, 60.0
LIMITS = np.array([0.05 * (LOWER + UPPER) * G, 0.3 * UPPER * G])  # N


def stick_and_slip(state, end):
    """The state of two blocks, the lower one on a spring, at the end, and the events, by equations of their own.

    M q̈ + K q = −friction of the joints, which is ± its limit where they slide (mode ±1) or what keeps them still (0).
    """
    mass = np.array([[LOWER + UPPER, UPPER], [UPPER, UPPER]])

    def solved(y, modes):
        """Accelerations and friction of both joints."""
        sticks = np.diag([float(mode == 0) for mode in modes])
        matrix = np.block([[mass, np.eye(2)], [sticks, np.eye(2) - sticks]])
        answer = np.linalg.solve(matrix, [-STIFF * y[0], 0.0, *(np.array(modes) * LIMITS)])
        return answer[:2], answer[2:]

    def consistent(y, modes, crossed):
        """The first case of sticking and sliding that friction and accelerations allow; one that was left is none."""
        choices = [(0, 1, -1) if abs(rate) < 1e-7 or k == crossed else (int(np.sign(rate)),)
                   for k, rate in enumerate(y[2:])]  # fmt: skip
        for case in itertools.product(*choices):
            second, friction = solved(y, case)
            good = [abs(friction[k]) <= LIMITS[k] * (1 + 1e-9) if mode == 0 else mode * second[k] >= -1e-6
                    for k, mode in enumerate(case) if len(choices[k]) > 1]  # fmt: skip
            if all(good) and not (crossed is not None and modes[crossed] == case[crossed] == 0):
                return case
        raise AssertionError("no case is consistent")

    def watched(k, modes):
        """What stays above 0 until the k-th joint does something else."""

        def left(_, y):
            return 1e-11 + float(modes[k] * y[2 + k] if modes[k] else LIMITS[k] - abs(solved(y, modes)[1][k]))

        left.terminal, left.direction = True, -1.0
        return left

    time, modes, changes = 0.0, consistent(state, (0, 0), None), list[tuple[str, str, float]]()
    while True:
        part = solve_ivp(
            lambda t, y, modes=modes: np.concatenate([y[2:], solved(y, modes)[0]]), (time, end), state, method="DOP853",
            rtol=1e-11, atol=1e-12, events=[watched(k, modes) for k in range(2)], max_step=0.02,
        )  # fmt: skip
        time, state = float(part.t[-1]), part.y[:, -1].copy()
        if not part.status:
            return state, changes
        crossed = next(k for k, times in enumerate(part.t_events) if len(times))
        before, modes = modes, consistent(state, modes, crossed)
        changed = [k for k in range(2) if bool(before[k]) != bool(modes[k])]
        changes += [("stick" if before[k] else "break-away", "AB"[k], time) for k in changed]


def test_blocks_stick_and_slip_as_their_equations_say():
    """The lower one is held by a spring, the upper one by friction alone."""
    model = stack(
        (LOWER, UPPER), (0.05, 0.3), (0, 0), springs={"k": {"joint": "A", "stiffness": STIFF, "free_length": 0}}
    )
    model = model.with_values({"drivers.A.initial.coordinate": 0.4})
    data = simulate(model, 1.3, 20)
    end, expected = stick_and_slip(np.array([0.4, 0.0, 0.0, 0.0]), 1.3)
    found = [event[:3] for event in events(data) if event[2] > 0]
    assert found == [(kind, of, pytest.approx(time, abs=1e-7)) for kind, of, time in expected]
    assert data.drive_coordinate[:, -1].values == pytest.approx(end[:2], abs=1e-7)
    assert float(abs(data.energy_residual).max()) < 1e-8 * float(data.work_friction[-1])
    assert [kind for kind, of, _ in found if of == "B"] == ["stick", "break-away"]
    assert data.sticking.sel(joint="B").values.sum() == 1  # of the rows, 65 ms apart
    assert not data.sticking.sel(joint="A").values.any()


@pytest.mark.spread(1)
@pytest.mark.parametrize("seed", range(2))
def test_a_stack_at_rest_accelerates_so_that_gauss_constraint_is_least(seed):
    """Four stacked on each other, each pushed: of all accelerations that with the least ½ aᵀMa − Fᵀa + Σ μ N |Δa|, a
    convex function whose minimum is found by clarabel, apart from this code."""
    random = np.random.default_rng(seed)
    masses, rough, pushes = random.uniform(1, 3, 4), random.uniform(0.05, 0.6, 4), random.normal(0, 12, 4)
    loads = {body: {"link": body, "at": body.upper(), "force": [float(push), 0]}
             for body, push in zip("abcd", pushes, strict=True)}  # fmt: skip
    data = simulate(stack(masses, rough, (0, 0, 0, 0), loads=loads), 0.1, 1)
    normal = np.cumsum(masses[::-1])[::-1] * G
    across = np.eye(4) - np.eye(4, k=-1)  # Δa of each joint
    # min ½ aᵀMa − Fᵀa + (μN)ᵀt with −t ≤ Δa ≤ t
    quadratic = np.zeros((8, 8))
    quadratic[:4, :4] = np.diag(masses)
    rows = np.block([[across, -np.eye(4)], [-across, -np.eye(4)]])
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = False, 1e-12, 1e-12, 1e-12
    solved = clarabel.DefaultSolver(
        csc_matrix(quadratic), np.concatenate([-pushes, rough * normal]), csc_matrix(rows), np.zeros(8),
        [clarabel.NonnegativeConeT(8)], settings,
    ).solve()  # fmt: skip
    assert data.drive_rate.values[:, -1] == pytest.approx(0.1 * across @ np.array(solved.x[:4]), abs=1e-6)


# ---- Painlevé's rod -------------------------------------------------------------------------------------------

ROD, HALF, SLIDER, ROUGH = 1.0, 0.5, 0.02, 2.0
AROUND = ROD * HALF**2 * 4 / 3
ANGLE = np.pi / 3


def rod(torque, friction=0.0, rough=ROUGH):
    """A rod hinged to a light slider in a rough guide; a moment turns it."""
    return Mechanism(
        gravity=[0, -G],
        links={
            "ground": {"points": {"A": AXIS}},
            "slider": {"points": {"A": AXIS, "B": [0, 0]}, "mass": SLIDER},
            "rod": {"points": {"B": [0, 0]}, "mass": ROD, "inertia": ROD * HALF**2 / 3, "centre": [HALF, 0]},
        },
        joints=joined(
            "ground =A= slider -B- rod",
            A={"friction": rough, "guide": {"length": 5}},
            B={"pin": {"radius": 0.02}, "friction": friction},
        ),
        drivers={
            "A": {"speed": 1, "range": [-5, 5], "free": True, "initial": {"coordinate": 0, "speed": 1}},
            "B": {"speed": 1, "free": True, "initial": {"coordinate": ANGLE, "speed": 0}},
        },
        loads={"turn": {"link": "rod", "moment": torque}},
    )


def solutions(torque, rough):
    """How many accelerations Newton's laws have at the start, with the guide pushing up or down (P. Painlevé, 1895)."""
    count, sine, cosine = 0, np.sin(ANGLE), np.cos(ANGLE)
    for side in (1.0, -1.0):
        matrix = np.array([
            [ROD + SLIDER, -ROD * HALF * sine, rough * side],
            [-ROD * HALF * sine, AROUND, 0.0],
            [0.0, -ROD * HALF * cosine, 1.0],
        ])  # fmt: skip
        normal = np.linalg.solve(matrix, [0.0, torque - ROD * G * HALF * cosine, (ROD + SLIDER) * G])[2]
        count += bool(side * normal > 0.0)
    return count


@pytest.mark.spread(1)
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_painleves_rod_stops_by_the_momentum_about_its_pin(friction):
    """No acceleration: the slider stops at once. Of J Δω − m a sin φ Δv = ∓ f r |S|, S the impulse on the rod's end,
    follows ω; without friction in the pin it is Müller's condition."""
    assert solutions(-10.0, ROUGH) == 0
    data = simulate(rod(-10.0, friction), 0.01, 2)
    (time, lost) = next((time, lost) for kind, of, time, lost in events(data) if (kind, of) == ("lock", "A"))
    assert time == 0.0
    sine, cosine, omega = np.sin(ANGLE), np.cos(ANGLE), 0.0
    for _ in range(60):
        impulse = ROD * np.hypot(-1.0 - HALF * sine * omega, HALF * cosine * omega)
        omega = (-ROD * HALF * sine + friction * 0.02 * impulse) / AROUND
    assert data.drive_rate.values[:, 0] == pytest.approx([0.0, omega], abs=1e-9)
    # ½ m v² of all before; the rod's centre moves on about the pin after
    assert lost == pytest.approx(0.5 * (ROD + SLIDER) - 0.5 * AROUND * omega**2, rel=1e-9)
    assert (lost or 0.0) > 0.0
    assert float(abs(data.energy_residual).max()) < 1e-8


@pytest.mark.parametrize(("torque", "rough", "known"), [(0.0, ROUGH, 2), (0.0, 1.0, 1), (-10.0, 1.0, 1)])
def test_several_accelerations_are_told(torque, rough, known):
    assert solutions(torque, rough) == known
    found = findings(simulate(rod(torque, rough=rough), 1e-4, 1))
    assert ("simulate.several_accelerations" in found) == (known > 1)
    assert "simulate.locks" not in found


# ---- rest -----------------------------------------------------------------------------------------------------


def wheels(motor=None, speed=3.0):
    """Two wheels beside each other, each with its drag."""
    data = beside(wheel(motor, drag=0.6, initial={"speed": 2 * speed}), speed).data()
    return Mechanism(**{**data, "loads": {**data["loads"], "seal": {"joint": "W", "resisting_torque": 0.6}}})


def test_all_free_drivers_come_to_rest():
    data = simulate(wheels({"kind": "constant", "effort": 0.45}), 3.0, 30)
    done = 6.0 * 0.05 / (0.6 - 0.45)
    assert [(kind, of) for kind, of, *_ in events(data)] == [("stick", "W"), ("stick", "A"), ("rest", "A")]
    assert events(data)[-1][2] == pytest.approx(done, abs=1e-8)
    assert data.resting.values.tolist() == [int(time > done) for time in data.time.values]
    told = findings(data)["simulate.stalls"]
    assert (told["joint"], told["drivers"]) == ("A", ["A"])
    assert told["share"] == pytest.approx(0.45 / 0.6, rel=1e-9)
    ways = {one.name: one.value for one in summary_of(data) if one.name.endswith(("run_down", "run_down_way"))}
    assert ways["W.run_down"] == pytest.approx(done, abs=1e-8)
    assert ways["W.run_down_way"] == pytest.approx(0.5 * 3.0 * 3.0 * 0.05 / 0.6, rel=1e-8)
    switched = simulate(wheels({"kind": "constant", "effort": 0.45, "off_from": 1.5}), 3.0, 3)
    assert "simulate.rests" in findings(switched)


def test_nothing_starts():
    data = simulate(wheels({"kind": "constant", "effort": 0.45}, speed=0.0), 1.0, 4)
    assert findings(data)["simulate.stays_at_rest"]["share"] == pytest.approx(0.75)
    assert data.resting.values.all()
    assert not data.drive_rate.values.any()


def test_a_braked_motor_with_a_lossy_gear_stops_as_its_closed_form_says():
    motor = {"kind": "constant", "effort": 2, "efficiency": 0.8, "off_from": 1.0, "brake": 0.4, "brake_from": 1.0}
    data = simulate(beside(wheel(motor, drag=0.6)), 3.0, 30)
    assert ("stick", "A", pytest.approx(2.0, abs=1e-8)) in [event[:3] for event in events(data)]
    assert data.drive_coordinate.sel(driver="A").values[-1] == pytest.approx(20.0, abs=1e-7)  # 10 on either side of 1 s
    assert data.drive_rate.sel(driver="W").values[-1] == pytest.approx(3.0, abs=1e-9)
