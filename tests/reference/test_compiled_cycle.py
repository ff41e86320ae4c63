"""All variables of a cycle by the compiled engine against NumPy's, with the locking margin and the statuses."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO
from trunnion import Mechanism, MechanismError, Status
from trunnion.cycle.cycle_kernel import compiles
from trunnion.cycle.positions import Positions, positions
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import prepare
from trunnion.solve.walk_kernel import WalkKernel

EXAMPLES = DURANGO.parent
OF_THE_ITERATION = {"friction_iterations", "friction_change", "friction_residual", "friction_contraction"}
ROUNDING = {"power_residual", "closure_residual"}
AGREE = 1e-9  # of the peak
RATIOS = 1e-6  # no sharper where the drive turns round


@pytest.fixture(autouse=True, scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("compiled")))
        yield


def both(mechanism: Mechanism, steps: int) -> tuple[Positions, Positions]:
    run = prepare(mechanism)
    one, other = (positions(run, steps, averaged=False, engine=engine) for engine in ("numpy", "compiled"))
    return one, other


def agree(one: Positions, other: Positions) -> None:
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
    for name in ROUNDING:
        assert np.nanmax(np.abs(other.arrays[name]), initial=0.0) < 1e-9 * max(1.0, np.nanmax(np.abs(power(one))))


def power(found: Positions) -> Any:
    return np.append(found.arrays["drive_power"].ravel(), found.arrays["friction_power"].ravel())


FEW = ["durango-fourbar", "slider-crank", "drawing-press", "cardan-gears", "universal-joint"]
MORE = [
    "andrews-squeezer", "chebyshev-line", "five-bar-robot", "geared-five-bar", "inverted-slider-crank", "jansen",
    "one-way-clutch", "pezzuti-cardan", "rccc", "rssp", "rssr", "scotch-yoke", "spring-balanced-lamp",
    "swash-plate-pump", "toggle-press", "watt-six-bar", "whitworth-quick-return",
]  # fmt: skip


@pytest.mark.sample(9)
@pytest.mark.parametrize("example", [*FEW, *(pytest.param(one, marks=pytest.mark.slow) for one in MORE)])
def test_every_variable_agrees(example: str) -> None:
    agree(*both(trunnion.read(EXAMPLES / f"{example}.yaml"), 180))


def test_the_margin_is_that_of_numpy_and_finite_somewhere() -> None:
    one, other = both(trunnion.read(EXAMPLES / "drawing-press.yaml"), 90)
    margins = one.arrays["locking_margin"]
    assert np.count_nonzero(np.isfinite(margins)) > 30
    agree(one, other)


def test_positions_that_cannot_be_reached_or_lock_are_those_of_numpy() -> None:
    """A crank that is too long, and a coefficient at which the press locks: NumPy decides these positions."""
    long = trunnion.read(DURANGO)
    name = long.path_of("AB")
    longer = long.with_values({name: 2.5 * float(long.parameters()[name])})
    for mechanism, code in ((longer, Status.NOT_ASSEMBLED), (locking(), Status.LOCKED)):
        one, other = both(mechanism, 120)
        assert np.any(one.arrays["status"] == code)
        agree(one, other)


def locking() -> Mechanism:
    mechanism = trunnion.read(EXAMPLES / "drawing-press.yaml")
    paths = [path for path in mechanism.parameters() if path.endswith("friction.coefficient")]
    return mechanism.with_values({path: 6 * float(mechanism.parameters()[path]) for path in paths})


def test_errors_stand_beside_the_ideal_mechanism() -> None:
    one, other = both(trunnion.read(EXAMPLES / "fourbar-by-grades.yaml"), 60)
    agree(one, other)


def test_findings_and_summary_are_the_same() -> None:
    mechanism = trunnion.read(EXAMPLES / "slider-crank.yaml")
    one, other = (trunnion.analyse(mechanism, 200, engine=engine) for engine in ("numpy", "compiled"))
    assert [found.what for found in one.trunnion.findings] == [found.what for found in other.trunnion.findings]
    figures = [{figure.name: figure.value for figure in result.trunnion.summary} for result in (one, other)]
    assert figures[0].keys() == figures[1].keys()
    for name, value in figures[0].items():
        if name not in ("power_residual", "friction_iterations") and isinstance(value, float):
            assert figures[1][name] == pytest.approx(value, rel=1e-9, nan_ok=True), name


def test_what_only_numpy_does_is_said() -> None:
    mechanism, method = trunnion.read(DURANGO), FrictionMethod("successive-approximation")
    for engine in ("compiled", "fortran"):
        with pytest.raises(MechanismError) as caught:
            trunnion.analyse(mechanism, 10, method, engine=engine)
        assert caught.value.findings[0].where == "engine"
    assert trunnion.analyse(mechanism, 10, method).sizes["position"] == 10  # auto: NumPy


def test_pins_in_seats_are_left_to_numpy() -> None:
    """They settle in rounds, at each position as many as it needs; those that are given too, for they travel."""
    mechanism = trunnion.read(EXAMPLES / "fourbar-with-play.yaml")
    given = mechanism.with_seats("free").with_values({"joints.B.seat": {"xi": "30 deg"}})
    for model in (mechanism.with_seats("loaded"), given):
        assert not compiles("auto", prepare(model), 10**6)
        with pytest.raises(MechanismError, match="pins in seats settle in rounds") as caught:
            trunnion.analyse(model, 12, engine="compiled")
        (finding,) = caught.value.findings
        assert finding.where.endswith(".seat")
        assert finding.remedy == "use the engine numpy"
    assert compiles("auto", prepare(mechanism.with_seats("free")), 10**6)


# ---- machine code that is kept --------------------------------------------------------------------------------


def kernel_of(figure: str, described: str | None = "efforts") -> WalkKernel:
    run = prepare(trunnion.read(DURANGO))
    return WalkKernel(run, {figure: lambda back: back.efforts["A"]}, described=described)


def curve(kernel: WalkKernel) -> Any:
    run = kernel.run
    (found,) = kernel.curves(run.values, run.cycle.times(24))[0].values()
    return found[0]


def test_kept_code_is_found_without_recording(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = curve(kernel_of("one"))
    recorded: list[int] = []
    plain = WalkKernel._recorded
    monkeypatch.setattr(WalkKernel, "_recorded", lambda self, inputs: recorded.append(1) or plain(self, inputs))
    assert np.array_equal(curve(kernel_of("one")), first)
    assert not recorded
    curve(kernel_of("other"))  # other figures
    curve(kernel_of("one", described=None))  # figures that nothing tells from others of this name
    assert len(recorded) == 2
    for path in (tmp_path / "trunnion" / "compiled").glob("*.key"):
        path.write_bytes(b"damaged")
    assert np.array_equal(curve(kernel_of("one")), first)
    assert len(recorded) == 3


def nowhere(_user: int) -> None:
    raise KeyError("uid not found")


def test_without_a_home_folder_it_is_compiled_anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As of a user whom the system does not know: `docker run --user`."""
    expected = curve(kernel_of("one"))
    for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA", "USERPROFILE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pwd.getpwuid", nowhere)
    monkeypatch.chdir(tmp_path)
    assert np.array_equal(curve(kernel_of("one")), expected)
    both(trunnion.read(DURANGO), 40)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("over", [{"AB": [1.9, 2.0]}, {"A.speed": [5.0, 6.0]}], ids=lambda over: "".join(over))
def test_a_sweep_again_records_nothing(over: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Neither to see whether it can be compiled, nor with times of each mechanism."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = trunnion.sweep(trunnion.read(DURANGO), over, 24, engine="compiled")
    monkeypatch.setattr(WalkKernel, "_recorded", lambda self, inputs: pytest.fail("it was recorded again"))
    assert trunnion.sweep(trunnion.read(DURANGO), over, 24, engine="compiled").identical(first)


def test_kept_code_of_another_law_is_not_taken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Another coefficient is the same program, another law is not."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    mechanism = trunnion.read(DURANGO)
    for changed in (mechanism, mechanism.with_friction("rolling-bearing"), mechanism.with_friction("off")):
        agree(*both(changed, 40))


def test_samples_are_the_same_by_any_number_of_threads() -> None:
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
        (
            "durango-fourbar",
            {"AB": ("0.9 m", "1.1 m", 3), "joint_defaults.friction.coefficient": ("0.05", "0.2", 2)},
            False,
        ),
        ("slider-crank", {"joint_defaults.friction.coefficient": ("0.05", "0.3", 4)}, True),
        pytest.param("pezzuti-cardan", {"misalignment": ("10 deg", "30 deg", 3)}, True, marks=pytest.mark.slow),
        pytest.param("fourbar-by-grades", {"l1": ("99 mm", "101 mm", 3)}, False, marks=pytest.mark.slow),
    ],
)
def test_a_sweep_has_the_figures_of_numpy(example: str, over: dict[str, Any], margin: bool) -> None:
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


def test_variance_based_indices_are_those_of_numpy() -> None:
    mechanism = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    one, other = (
        trunnion.tolerance(mechanism, methods=["sobol"], samples=640, steps=12, engine=engine)
        for engine in ("numpy", "compiled")
    )
    for name in ("first_order", "total_order"):
        assert np.nanmax(one[name].values) > 0.1
        np.testing.assert_allclose(one[name], other[name], atol=1e-8)


@pytest.mark.parametrize(
    "method",
    [
        trunnion.FrictionMethod("successive-approximation"),
        trunnion.FrictionMethod(criterion=1e-3),
        trunnion.FrictionMethod(limit=1),
    ],
)
def test_friction_settled_otherwise_is_left_to_numpy(
    method: trunnion.FrictionMethod, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_auto_takes_numpy_where_a_mechanism_cannot_be_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trunnion.cycle.cycle_kernel.WORTH_COMPILING", 1)
    mechanism = trunnion.read(EXAMPLES / "bennett.yaml")  # over-constrained
    one, other = (trunnion.analyse(mechanism, 8, engine=engine) for engine in ("auto", "numpy"))
    assert np.array_equal(one["reaction_force"], other["reaction_force"], equal_nan=True)
    path = next(path for path in mechanism.parameters() if path.endswith("speed"))
    swept = [trunnion.sweep(mechanism, {path: [1.0, 2.0]}, steps=8, engine=engine) for engine in ("auto", "numpy")]
    assert np.array_equal(swept[0]["drive_effort_max"], swept[1]["drive_effort_max"], equal_nan=True)


@pytest.mark.parametrize("steps", [1, 2, 5])
def test_few_positions(steps: int) -> None:
    agree(*both(trunnion.read(DURANGO), steps))


@pytest.mark.slow
def test_mechanisms_with_errors_and_without_go_by_programs_of_their_own() -> None:
    """Errors that are 0 in the ideal mechanism are none that its program could have left out of the other's."""
    mechanism = trunnion.read(EXAMPLES / "pezzuti-cardan-as-built.yaml").with_values({"joint_defaults.seat": "free"})
    agree(*both(mechanism, 40))
    one, other = (
        trunnion.sweep(mechanism, {"misalignment": ["10 deg", "20 deg"]}, steps=24, engine=engine)
        for engine in ("numpy", "compiled")
    )
    assert np.nanmax(one["transmission_error_max"].values) > 1e-5
    for name in ("transmission_error_max", "drive_effort_max", "efficiency", "efficiency_ideal"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-8, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("engine", ["numpy", "compiled"])
@pytest.mark.parametrize("example", ["durango-fourbar", "fourbar-by-grades"])
def test_the_memory_of_a_result_goes_with_it(example: str, engine: str) -> None:
    """At once, not when Python looks for objects that hold each other: a result may take all the memory there is."""
    mechanism = trunnion.read(EXAMPLES / f"{example}.yaml")
    trunnion.analyse(mechanism, 24, engine=engine)
    gc.collect()
    gc.disable()
    try:
        result = trunnion.analyse(mechanism, 24, engine=engine)
        held = [weakref.ref(result[name].variable.values) for name in ("point_position", "reaction_force", "status")]
        del result
        assert [array() for array in held] == [None] * len(held)
    finally:
        gc.enable()


def test_margins_that_have_to_be_followed_are_compiled_from_fewer_positions_on() -> None:
    """NumPy takes as long for one of them as for dozens of positions whose loads say at once that none locks."""
    plain, followed = (
        prepare(trunnion.read(EXAMPLES / f"{name}.yaml")) for name in ("durango-fourbar", "drawing-press")
    )
    asked = trunnion.FrictionMethod(margin_up_to=MARGIN)
    assert [compiles("auto", run, 10_000, asked) for run in (plain, followed)] == [False, True]
    assert not compiles("auto", followed, 10_000, trunnion.FrictionMethod(margin_up_to=0.0))
    assert not compiles("auto", followed, 1000, asked)
    assert compiles("auto", plain, 300_000, asked)
