"""All variables of a cycle by the compiled engine against NumPy's, with the locking margin and the statuses."""

import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO
from mechanisms_parts import EXAMPLES
from trunnion import Mechanism, MechanismError, Status
from trunnion.cycle.positions import positions
from trunnion.solve.backward import status_of
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.solve.walk_kernel import WalkKernel

OF_THE_ITERATION = {"friction_iterations", "friction_change", "friction_residual", "friction_contraction"}
ROUNDING = {"power_residual", "closure_residual"}
LAW = "joint_defaults.friction.coefficient"
AGREE = 1e-9  # of the peak
RATIOS = 1e-6  # no sharper where the drive turns round


@pytest.fixture(autouse=True, scope="module")
def cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("compiled")))
        yield


def both(mechanism, steps):
    run = prepare(mechanism)
    one, other = (positions(run, steps, averaged=False, engine=engine) for engine in ("numpy", "compiled"))
    return one, other


def agree(one, other):
    """Statuses are equal, numbers agree to AGREE of the largest of their variable, and there is none for none."""
    np.testing.assert_array_equal(one.arrays["status"], other.arrays["status"])
    for name in one.arrays.keys() - OF_THE_ITERATION - ROUNDING:
        a, b = (found.arrays[name].astype(float) for found in (one, other))
        np.testing.assert_array_equal(np.isfinite(a), np.isfinite(b), err_msg=name)
        known = np.isfinite(a)
        peak = np.max(np.abs(a[known]), initial=0.0)
        if peak > 1e-11:
            most = np.max(np.abs(a[known] - b[known]))
            assert most <= (RATIOS if name == "efficiency_instant" else AGREE) * peak, name
    most = max(np.nanmax(np.abs(one.arrays[name])) for name in ("drive_power", "friction_power"))
    for name in ROUNDING:
        assert np.nanmax(np.abs(other.arrays[name]), initial=0.0) < 1e-9 * max(1.0, most)


FEW = ["durango-fourbar", "drawing-press", "universal-joint"]
MORE = [
    "andrews-squeezer", "chebyshev-line", "five-bar-robot", "geared-five-bar", "inverted-slider-crank", "jansen",
    "one-way-clutch", "pezzuti-cardan", "rccc", "rssp", "rssr", "scotch-yoke", "spring-balanced-lamp",
    "swash-plate-pump", "toggle-press", "watt-six-bar", "whitworth-quick-return",
]  # fmt: skip


@pytest.mark.sample(5)
@pytest.mark.parametrize("example", [*FEW, *(pytest.param(one, marks=pytest.mark.slow) for one in MORE)])
def test_every_variable_agrees(example):
    agree(*both(trunnion.read(EXAMPLES / f"{example}.yaml"), 180))


def test_positions_that_cannot_be_reached_or_lock_are_those_of_numpy():
    """A crank that is too long, and a coefficient at which the press locks: NumPy decides these positions."""
    long = trunnion.read(DURANGO)
    name = long.path_of("AB")
    longer = long.with_values({name: 2.5 * float(long.parameters()[name])})
    press = trunnion.read(EXAMPLES / "drawing-press.yaml")
    rough = {path: 6 * value for path, value in press.parameters().items() if path.endswith("friction.coefficient")}
    for mechanism, code in ((longer, Status.NOT_ASSEMBLED), (press.with_values(rough), Status.LOCKED)):
        one, other = both(mechanism, 120)
        assert np.any(one.arrays["status"] == code)
        agree(one, other)


def test_errors_stand_beside_the_ideal_mechanism():
    one, other = both(trunnion.read(EXAMPLES / "fourbar-by-grades.yaml"), 60)
    agree(one, other)


def kernel_of(figure):
    return WalkKernel(prepare(trunnion.read(DURANGO)), {figure: lambda back: back.efforts["A"]})


def curve(kernel):
    run = kernel.run
    (found,) = kernel.curves(run.values, run.cycle.times(24))[0].values()
    return found[0]


def test_without_a_home_folder_it_is_compiled_anew(monkeypatch, tmp_path):
    """As of a user whom the system does not know: `docker run --user`."""
    expected = curve(kernel_of("one"))
    for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA", "USERPROFILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", {}.__getitem__)
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(curve(kernel_of("one")), expected)
    both(trunnion.read(DURANGO), 40)
    assert not list(tmp_path.iterdir())


def test_kept_code_of_another_law_is_not_taken(monkeypatch, tmp_path):
    """Another coefficient is the same program, another law is not."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mechanism = trunnion.read(DURANGO)
    for changed in (mechanism, mechanism.with_friction("rolling-bearing"), mechanism.with_friction("off")):
        agree(*both(changed, 40))


@pytest.mark.slow
def test_samples_are_the_same_by_any_number_of_threads():
    mechanism = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    one, other = (
        trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=9000, steps=30, engine="compiled", jobs=jobs)
        for jobs in (1, 3)
    )
    assert {"engine", "mean", "histogram"} <= {*one.attrs, *one.data_vars}
    for name, variable in one.data_vars.items():
        np.testing.assert_array_equal(variable.values, other[name].values, err_msg=str(name))


@pytest.mark.parametrize(
    ("example", "over", "margin"),
    [
        ("durango-fourbar", {"AB": ("0.9 m", "1.1 m", 3), LAW: ("0.05", "0.2", 2)}, False),
        ("slider-crank", {LAW: ("0.05", "0.3", 4)}, True),
    ],
)
def test_a_sweep_has_the_figures_of_numpy(example, over, margin):
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    one, other = (
        trunnion.sweep(mechanism, over, steps=90, margin=margin, engine=engine) for engine in ("numpy", "compiled")
    )
    for name, variable in one.data_vars.items():
        a, b = variable.values, other[name].values
        if a.dtype.kind != "f" or name == "efficiency_error":  # what rounding does to an integral
            continue
        np.testing.assert_array_equal(np.isfinite(a), np.isfinite(b), err_msg=str(name))
        known = np.isfinite(a)
        most = (RATIOS if name == "efficiency_instant" else AGREE) * np.max(np.abs(a[known]), initial=0.0)
        assert np.all(np.abs(a[known] - b[known]) <= most), name
    np.testing.assert_array_equal(one["status"], other["status"])


def test_pins_in_seats_are_left_to_numpy():
    """They settle in rounds, as many as each position needs; those that are given too, for they travel."""
    mechanism = trunnion.read(EXAMPLES / "fourbar-with-play.yaml")
    given = mechanism.with_seats("free").with_values({"joints.B.seat": {"xi": "30 deg"}})
    for model in (mechanism.with_seats("loaded"), given):
        with pytest.raises(MechanismError, match="pins in seats"):
            trunnion.analyse(model, 12, engine="compiled")


@pytest.mark.parametrize(
    "method", [FrictionMethod("successive-approximation"), FrictionMethod(criterion=1e-3), FrictionMethod(limit=1)]
)
def test_friction_settled_otherwise_is_left_to_numpy(method, monkeypatch):
    """A compiled program has its own fixed rounds of Newton's method: it would say converged where NumPy does not."""
    mechanism = trunnion.read(DURANGO)
    with pytest.raises(MechanismError) as caught:
        trunnion.analyse(mechanism, 12, method, engine="compiled")
    assert caught.value.findings[0].where == "engine"
    monkeypatch.setattr("trunnion.cycle.cycle_kernel.WORTH_COMPILING", 1)
    found, expected = (
        positions(prepare(mechanism), 12, method, averaged=False, engine=engine) for engine in ("auto", "numpy")
    )
    assert np.array_equal(found.arrays["status"], expected.arrays["status"])
    assert np.array_equal(found.arrays["friction_change"], expected.arrays["friction_change"], equal_nan=True)


@pytest.mark.slow
def test_auto_takes_numpy_where_a_mechanism_cannot_be_compiled(monkeypatch):
    monkeypatch.setattr("trunnion.cycle.cycle_kernel.WORTH_COMPILING", 1)
    mechanism = trunnion.read(EXAMPLES / "bennett.yaml")  # over-constrained
    one, other = (trunnion.analyse(mechanism, 8, engine=engine) for engine in ("auto", "numpy"))
    assert np.array_equal(one["reaction_force"], other["reaction_force"], equal_nan=True)
    path = next(path for path in mechanism.parameters() if path.endswith("speed"))
    swept = [trunnion.sweep(mechanism, {path: [1.0, 2.0]}, steps=8, engine=engine) for engine in ("auto", "numpy")]
    assert np.array_equal(swept[0]["drive_effort_max"], swept[1]["drive_effort_max"], equal_nan=True)


def same_as_numpy(run, names, time, spread=1e-3):
    """Drive effort of five samples, numbers of these names a random share more or less, by both; the statuses."""
    mechanism, rng = run.system.mechanism, np.random.default_rng(4)
    paths = [mechanism.path_of(name) for name in names]
    chosen = {path: run.values[path] * (1 + spread * rng.standard_normal((5, 1))) for path in paths}
    values, driver = mechanism.parameter_set.evaluate(chosen), next(iter(mechanism.drivers))
    kernel = WalkKernel(run, {"effort": lambda back: back.efforts[driver]})
    curves, status = kernel.curves(values, time)
    back = run.solve(time, values)
    with np.errstate(all="ignore"):
        expected = np.broadcast_to(back.efforts[driver], status.shape)
        np.testing.assert_array_equal(status, status_of(back, status.shape))
    np.testing.assert_allclose(curves["effort"], expected, rtol=1e-9, atol=1e-12 * np.nanmax(np.abs(expected)))
    return kernel, status


LAWS = [
    {"law": "viscous", "coefficient": 0.1, "viscous": 0.05},
    {"law": "stribeck", "coefficient": 0.1, "static": 0.15, "stribeck_speed": 0.02, "viscous": 0.01},
    {"law": "brown-mcphee", "coefficient": 0.1, "static": 0.15, "transition_speed": 0.02, "viscous": 0.01},
    {"law": "rolling-bearing", "coefficient": 0.0015},
]


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])
def test_friction_laws_of_samples(law):
    data = trunnion.read(DURANGO).data()
    data["joint_defaults"]["friction"] = law
    run = prepare(Mechanism(**data))
    same_as_numpy(run, ["AB", LAW], run.cycle.times(36))


def test_friction_without_proof_of_one_solution_is_numpys():
    """Where friction may lock, no fixed number of rounds decides."""
    model = trunnion.read(EXAMPLES / "slider-crank.yaml")
    paths = [path for path in model.parameter_set.entries if path.endswith("friction.coefficient")]
    run = prepare(model.with_values(dict.fromkeys(paths, 2.0)))
    sizes = [path for path in run.values if path.startswith("dimensions.") and run.values[path]][:2]
    assert same_as_numpy(run, sizes, run.cycle.times(36), 1e-4)[0].again > 0


def test_failures_of_samples_are_those_of_numpy():
    """Lengths so far off that some samples do not assemble and others come near to a dead centre."""
    run = prepare(trunnion.read(DURANGO))
    _, status = same_as_numpy(run, ["AB", "BC", "CD"], run.cycle.times(90), 0.2)
    assert {int(Status.NOT_ASSEMBLED), int(Status.SOLVED)} <= set(status.ravel())
