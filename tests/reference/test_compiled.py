"""The compiled kernels against NumPy's."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
import trunnion.studies.tolerance.kernel
from mechanisms import DURANGO, eccentric_press
from trunnion import Mechanism, MechanismError
from trunnion.errors import Status
from trunnion.measures.curves import value
from trunnion.measures.measures import named, outputs
from trunnion.solve.run import Run, prepare
from trunnion.solve.status import pose_status, status_of
from trunnion.solve.walk_kernel import WalkKernel

EXAMPLES = DURANGO.parent
SAMPLES = 5


@pytest.fixture(autouse=True, scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    folder = str(tmp_path_factory.mktemp("compiled"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", folder)
        yield


def figures(run: Run, *names: str) -> dict[str, Callable[[Any], Any]]:
    """What the measures of these names read off a walk."""

    def reader(measure: Any) -> Callable[[Any], Any]:
        return lambda back: value(measure, back.walk) if measure.of_motion else back.efforts[measure.subject]

    return {one.name: reader(one) for one in named(run.system.mechanism, names, run.values)}


def varied(run: Run, *names: str, spread: float = 1e-3) -> dict[str, Any]:
    """All numbers, those named with a random share more or less in every sample."""
    mechanism, rng = run.system.mechanism, np.random.default_rng(4)
    paths = [mechanism.path_of(name) for name in names]
    chosen = {path: run.values[path] * (1 + spread * rng.standard_normal((SAMPLES, 1))) for path in paths}
    return mechanism.parameter_set.evaluate(chosen)


def by_numpy(run: Run, values: Mapping[str, Any], time: Any, read: Mapping[str, Any]) -> tuple[dict[str, Any], Any]:
    back = run.solve(time, values)
    shape = (SAMPLES, len(time))
    with np.errstate(all="ignore"):
        return {name: np.broadcast_to(one(back), shape) for name, one in read.items()}, status_of(back, shape)


def agree(found: Any, expected: Any) -> None:
    for name, curve in expected.items():
        scale = np.nanmax(np.abs(curve))
        np.testing.assert_allclose(found[name], curve, rtol=1e-9, atol=1e-12 * scale, err_msg=name)


def free(run: Run) -> list[str]:
    """Dimensions and places of points that are stated as numbers, not as expressions of others, and are not 0."""
    entries = run.system.mechanism.parameter_set.entries
    kinds = ("dimensions.", "links.", "loop.")
    return [
        path for path, one in entries.items() if path.startswith(kinds) and not one.depends and run.values.get(path)
    ]


@pytest.mark.slow
def test_a_guide_beside_its_kink() -> None:
    """Where the load of a guide changes ends the compiled rounds agree with NumPy too, or are taken again."""
    run = prepare(eccentric_press())
    effort = figures(run, "effort:O")
    time = np.linspace(0.05, 6.2, 400)
    values = varied(run, "links.crank.points.P.x")
    curves, status = WalkKernel(run, effort, True).curves(values, time)
    expected, statuses = by_numpy(run, values, time, effort)
    agree(curves, expected)
    assert np.array_equal(status, statuses)


@pytest.mark.slow
@pytest.mark.parametrize(
    "example",
    ["durango-fourbar", "slider-crank", "whitworth-quick-return", "scotch-yoke", "geared-five-bar", "universal-joint"],
)
def test_agrees_with_numpy(example: str) -> None:
    """Of dyads of all kinds, a general group and a closed form in space: motion and forces with friction, by status."""
    run = prepare(trunnion.read(EXAMPLES / f"{example}.yaml"))
    motion = [one.name for one in outputs(run.system)][:1]
    read_off = figures(run, *motion, *(f"effort:{driver}" for driver in run.system.mechanism.drivers))
    values, time = varied(run, *free(run)[:4]), run.cycle.times(72)
    kernel = WalkKernel(run, read_off)
    curves, status = kernel.curves(values, time)
    expected, expected_status = by_numpy(run, values, time, read_off)
    np.testing.assert_array_equal(status, expected_status)
    agree(curves, expected)
    assert kernel.again < status.size / 2


def test_motion_alone() -> None:
    run = prepare(trunnion.read(DURANGO))
    read_off = figures(run, "angle:rocker", "coupler.E.x")
    values, time = varied(run, "AB", "BC"), run.cycle.times(90)
    curves, status = WalkKernel(run, read_off, forces=False).curves(values, time)
    back = run.solve(time, values)
    np.testing.assert_array_equal(status, pose_status(back.walk, status.shape))
    agree(curves, by_numpy(run, values, time, read_off)[0])


@pytest.mark.slow
@pytest.mark.parametrize("example", ["inverted-slider-crank", "jansen", "rccc"])
def test_motion_of_other_modules(example: str) -> None:
    """A general group with slides, three loops, a closed form in space."""
    run = prepare(trunnion.read(EXAMPLES / f"{example}.yaml"))
    read_off = figures(run, *(one.name for one in outputs(run.system)))
    values, time = varied(run, *free(run)[:4], spread=1e-4), run.cycle.times(72)
    curves, status = WalkKernel(run, read_off, forces=False).curves(values, time)
    np.testing.assert_array_equal(status, pose_status(run.solve(time, values).walk, status.shape))
    agree(curves, by_numpy(run, values, time, read_off)[0])


LAWS: list[dict[str, Any]] = [
    {"law": "viscous", "coefficient": 0.1, "viscous": 0.05},
    {"law": "stribeck", "coefficient": 0.1, "static": 0.15, "stribeck_speed": 0.02, "viscous": 0.01},
    {"law": "brown-mcphee", "coefficient": 0.1, "static": 0.15, "transition_speed": 0.02, "viscous": 0.01},
    {"law": "rolling-bearing", "coefficient": 0.0015},
]


def with_law(law: dict[str, Any]) -> Run:
    data = trunnion.read(DURANGO).data()
    data["joint_defaults"]["friction"] = law
    return prepare(Mechanism.model_validate(data))


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law["law"])
def test_friction_laws(law: dict[str, Any]) -> None:
    run = with_law(law)
    read_off = figures(run, "effort:A")
    values, time = varied(run, "AB", "joint_defaults.friction.coefficient"), run.cycle.times(36)
    curves, status = WalkKernel(run, read_off).curves(values, time)
    expected, expected_status = by_numpy(run, values, time, read_off)
    np.testing.assert_array_equal(status, expected_status)
    agree(curves, expected)


def test_bristles_are_left_to_numpy() -> None:
    run = with_law({"law": "dahl", "coefficient": 0.12, "stiffness": 4e3})
    with pytest.raises(MechanismError, match="memory along the cycle"):
        WalkKernel(run, {})


@pytest.mark.parametrize(
    ("example", "coefficient"), [("slider-crank", 1.3), ("slider-crank", 2.0), ("toggle-press", 2.0)]
)
def test_friction_without_proof_of_one_solution_is_numpys(example: str, coefficient: float) -> None:
    """Where friction may lock, no fixed number of rounds decides."""
    model = trunnion.read(EXAMPLES / f"{example}.yaml")
    paths = [path for path in model.parameter_set.entries if path.endswith("friction.coefficient")]
    run = prepare(model.with_values(dict.fromkeys(paths, coefficient)))
    driver = next(iter(model.drivers))
    read_off = figures(run, f"effort:{driver}")
    values, time = varied(run, *free(run)[:2], spread=1e-4), run.cycle.times(36)
    kernel = WalkKernel(run, read_off)
    curves, status = kernel.curves(values, time)
    expected, expected_status = by_numpy(run, values, time, read_off)
    assert kernel.again > 0
    np.testing.assert_array_equal(status, expected_status)
    agree(curves, expected)


def test_failures_are_those_of_numpy() -> None:
    """Lengths so far off that some samples do not assemble and others come near to a dead centre."""
    run = prepare(trunnion.read(DURANGO))
    read_off = figures(run, "angle:rocker", "effort:A")
    values, time = varied(run, "AB", "BC", "CD", spread=0.2), run.cycle.times(90)
    curves, status = WalkKernel(run, read_off).curves(values, time)
    expected, expected_status = by_numpy(run, values, time, read_off)
    assert np.any(status == Status.NOT_ASSEMBLED)
    assert np.any(status == Status.SOLVED)
    np.testing.assert_array_equal(status, expected_status)
    agree(curves, expected)


@pytest.mark.slow
def test_any_number_of_samples_and_times_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Times that differ from sample to sample."""
    run = prepare(trunnion.read(DURANGO))
    read_off = figures(run, "effort:A")
    values = varied(run, "AB")
    time = run.cycle.times(30) + np.linspace(0.0, 0.01, SAMPLES)[:, None]
    curves, _ = WalkKernel(run, read_off).curves(values, time)
    back = run.solve(time, values)
    agree(curves, {"effort:A": back.efforts["A"]})


def test_what_only_numpy_does_is_said() -> None:
    run = prepare(trunnion.read(EXAMPLES / "bennett.yaml"))
    with pytest.raises(MechanismError, match=r"over-constrained.*use the engine numpy"):
        WalkKernel(run, {})


@pytest.mark.slow
def test_the_engine_is_imported_only_where_asked_for() -> None:
    code = "import sys, trunnion.studies.tolerance.kernel; sys.exit('llvmlite' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False, cwd=Path(__file__).parent).returncode == 0


def toleranced(engine: str, **options: Any) -> Any:
    model = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml")
    return trunnion.tolerance(model, methods=["monte-carlo"], steps=36, engine=engine, jobs=1, **options)


def test_a_whole_study_by_the_compiled_engine() -> None:
    """The same random numbers, the same moments and counts."""
    numpy, found = (toleranced(engine, samples=700) for engine in ("numpy", "compiled"))
    assert found.attrs["engine"] == "compiled"
    for name, variable in numpy.data_vars.items():
        if variable.dtype.kind == "f":
            scale = np.nanmax(np.abs(variable.values), initial=0.0)
            np.testing.assert_allclose(found[name], variable, rtol=1e-7, atol=1e-9 * scale, err_msg=name)
        else:
            assert np.array_equal(found[name], variable), name


def test_the_engine_is_chosen_by_size(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = trunnion.studies.tolerance.kernel
    assert toleranced("auto", samples=200).attrs["engine"] == "numpy"
    monkeypatch.setattr(kernel, "WORTH_COMPILING", 7_000)
    found = toleranced("auto", samples=200)
    assert found.attrs["engine"] == "compiled"
    assert [one.figures for one in found.trunnion.findings if one.code == "samples.engine"] == [{"engine": "compiled"}]


@pytest.mark.slow
def test_auto_leaves_to_numpy_what_only_numpy_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trunnion.studies.tolerance.kernel, "WORTH_COMPILING", 1)
    data = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").data()
    data["joint_defaults"]["friction"] = {"law": "dahl", "coefficient": 0.12, "stiffness": 4e3}
    found = trunnion.tolerance(
        Mechanism.model_validate(data), ["effort:A"], methods=["monte-carlo"], samples=20, steps=12, engine="auto"
    )
    assert found.attrs["engine"] == "numpy"
