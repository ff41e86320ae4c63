"""The engine for a GPU: PTX of every example, the same kernels run on the processor by a stand-in for the driver."""

from __future__ import annotations

import re
import shutil
import site
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO
from trunnion import Mechanism, MechanismError
from trunnion.cli import app as cli
from trunnion.engines import device
from trunnion.measures.measures import outputs
from trunnion.solve.run import prepare

pytest.importorskip("llvmlite")

import benchmarks.gpu

from stand_in_device import StandIn, as_text
from trunnion.engines.device import ptx
from trunnion.engines.graph import BOTH, Graph
from trunnion.engines.program import program
from trunnion.engines.reductions import NAMES, reductions
from trunnion.solve.compiled_device import DeviceKernel
from trunnion.solve.compiled_vectors import VectorKernel, inputs_of

EXAMPLES = DURANGO.parent
TOLERANCED = EXAMPLES / "toleranced-fourbar.yaml"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))


@pytest.fixture
def stand(monkeypatch: pytest.MonkeyPatch) -> Iterator[StandIn]:
    """A device that this processor plays; whatever happens, all of its memory is freed."""
    driver = StandIn()
    monkeypatch.setattr(device, "ptx", as_text)
    monkeypatch.setattr(device, "import_module", lambda name: driver)
    yield driver
    assert driver.memory == {}


def found_here() -> bool:
    try:
        device.device()
    except MechanismError:
        return False
    return True


gpu = pytest.mark.skipif(not found_here(), reason="a GPU of NVIDIA and cuda-bindings")


def assembler() -> str | None:
    """ptxas, on the path or in the package nvidia-cuda-nvcc."""
    packages = (path for folder in site.getsitepackages() for path in Path(folder).glob("nvidia/*/bin/ptxas"))
    return shutil.which("ptxas") or next(map(str, packages), None)


def assemble(text: str, folder: Path) -> None:
    """Nothing is said of it by NVIDIA's assembler, where that is installed."""
    if (ptxas := assembler()) is not None:
        (folder / "kernel.ptx").write_text(text)
        told = [ptxas, "-arch=sm_90", str(folder / "kernel.ptx"), "-o", str(folder / "kernel.cubin")]
        assert subprocess.run(told, capture_output=True, text=True, check=False).stderr == ""


def kernels(file: Path, engine: type[VectorKernel]) -> tuple[Any, dict[str, Any], Any]:
    """A kernel of all efforts and of the outputs, numbers that differ by sample, times."""
    run = prepare(trunnion.read(file))
    figures: dict[str, Any] = {one.name: lambda back, one=one: one.value(back.walk) for one in outputs(run.system)}
    figures |= {name: lambda back, name=name: back.efforts[name] for name in run.system.mechanism.drivers}
    entries, rng = run.system.mechanism.parameter_set.entries, np.random.default_rng(4)
    free = [
        path for path, one in entries.items()
        if path.startswith(("dimensions.", "links.")) and not one.depends and run.values.get(path)
    ]  # fmt: skip
    values = {path: run.values[path] * (1 + 1e-4 * rng.standard_normal((5, 1))) for path in free[:3]}
    return engine(run, figures), run.system.mechanism.parameter_set.evaluate(values), run.cycle.times(24)


@pytest.mark.spread(4, "rssr")
@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_example_that_compiles_is_ptx(file: Path, tmp_path: Path) -> None:
    """Verified by LLVM, and by NVIDIA's assembler where it is installed; of 64 bits, with no function left open."""
    try:
        kernel, values, time = kernels(file, VectorKernel)
        graph, nodes = kernel._recorded(inputs_of(values, time))
    except MechanismError:
        pytest.skip("only NumPy takes it")
    text = device.ptx(program(graph, nodes, 1, threads=True).text).rstrip(b"\0").decode()
    assert ".visible .entry kernel(" in text
    assert not re.search(r"\.f32|^\s*call|\.extern|\.approx", text, re.MULTILINE)
    assemble(text, tmp_path)


@pytest.mark.spread(4, "rccc", "toggle-press")
@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.yaml")), ids=lambda file: file.stem)
def test_threads_give_what_vectors_give(file: Path, stand: StandIn) -> None:
    """The kernel of the device, run here thread by thread, beside the compiled engine: numbers, statuses, doubts."""
    try:
        kernel, values, time = kernels(file, VectorKernel)
        kernel.check(values)
    except MechanismError:
        pytest.skip("only NumPy takes it")
    expected, statuses = kernel.curves(values, time)
    threads = kernels(file, DeviceKernel)[0]
    curves, status = threads.curves(values, time)
    np.testing.assert_array_equal(status, statuses)
    assert threads.again == kernel.again
    for name, curve in expected.items():
        peak = np.max(np.abs(curve), where=np.isfinite(curve), initial=0.0)
        np.testing.assert_allclose(curves[name], curve, rtol=1e-12, atol=1e-12 * peak, err_msg=name)


def test_the_driver_is_called_in_order(stand: StandIn) -> None:
    kernel, values, time = kernels(DURANGO, DeviceKernel)
    kernel.curves(values, time)
    kernel.curves(values, time)
    opened = ["cuInit", "cuDeviceGet", "cuDevicePrimaryCtxRetain"]
    assert stand.calls[: len(opened)] == opened
    assert [stand.calls.count(name) for name in ("cuModuleLoadData", "cuLaunchKernel", "cuCtxSynchronize")] == [1, 2, 2]
    assert stand.calls.index("cuCtxSetCurrent") < stand.calls.index("cuModuleLoadData")
    assert stand.calls.count("cuMemAlloc") == stand.calls.count("cuMemFree") == 4


@pytest.mark.parametrize("call", ["cuMemAlloc", "cuMemcpyHtoD", "cuLaunchKernel", "cuCtxSynchronize", "cuMemcpyDtoH"])
def test_a_call_that_fails_is_told_and_frees_what_is_held(stand: StandIn, call: str) -> None:
    kernel, values, time = kernels(DURANGO, DeviceKernel)
    stand.failing.add(call)
    with pytest.raises(MechanismError, match=f"the GPU reports CUDA_ERROR_OUT_OF_MEMORY at {call}"):
        kernel.curves(values, time)


def test_other_numbers_than_numpys_are_refused(stand: StandIn, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a device or a compiler that errs would give them."""
    kernel, values, time = kernels(DURANGO, DeviceKernel)
    text = device.ptx

    def wrong(told: str) -> bytes:
        return text(told.replace("fadd contract", "fsub contract", 1))

    monkeypatch.setattr(device, "ptx", wrong)
    with pytest.raises(MechanismError, match=r"the GPU gives other numbers than NumPy for .*: its result is refused"):
        kernel.curves(values, time)


def test_without_a_device_there_is_one_finding(
    stand: StandIn, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    stand.devices = 0
    command = ["trunnion", "tolerance", str(TOLERANCED), "--engine", "gpu", "--samples", "100"]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "no GPU of NVIDIA with its driver is found: the GPU reports CUDA_ERROR_NO_DEVICE at cuInit" in told
    assert told.endswith("use the engine compiled")


def test_without_its_packages_there_is_one_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> Any:
        raise ImportError(f"No module named '{name}'")

    monkeypatch.setattr(device, "import_module", missing)
    with pytest.raises(MechanismError, match="needs the packages llvmlite and cuda-bindings") as caught:
        trunnion.tolerance(trunnion.read(TOLERANCED), samples=100, engine="gpu")
    assert caught.value.findings[0].remedy == "pip install 'trunnion[gpu]', or use the engine compiled"


# ---- studies --------------------------------------------------------------------------------------------------


def alike(mechanism: Mechanism, **options: Any) -> Any:
    """A study by a GPU and by the compiled engine: counts equal, moments close."""
    told = {"methods": ["monte-carlo"], "samples": 400, "steps": 72, **options}
    found, expected = (trunnion.tolerance(mechanism, engine=engine, **told) for engine in ("gpu", "compiled"))
    for name in ("histogram", "failed", "samples", "yield", "yield_all", "band"):
        np.testing.assert_array_equal(found[name].values, expected[name].values, err_msg=name)
    for name in ("mean", "deviation", "least", "most", "kurtosis"):
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=1e-11, atol=1e-15, err_msg=name)
    np.testing.assert_allclose(found["skewness"].values, expected["skewness"].values, rtol=1e-11, atol=1e-11)
    return found


def with_measures(tolerances: dict[str, Any] | None = None, **measures: Any) -> Mechanism:
    """A four-bar of which this is measured."""
    data = trunnion.read(TOLERANCED).data()
    data["links"]["coupler"]["points"]["E"] = ["l3 / 2", "20 mm"]
    return Mechanism(**{**data, "measures": measures, "tolerances": {**data["tolerances"], **(tolerances or {})}})


RULES: dict[str, Any] = {
    "deviation": {"angle": "rocker", "limit": "±0.1 deg"},
    "angle that gains a turn": {"angle": "crank", "as": "maximum"},
    "largest in a window past the end": {"angle": "rocker", "as": "largest", "over": ["300 deg", "60 deg"]},
    "least": {"angle": "rocker", "as": "minimum"},
    "place": {"angle": "rocker", "as": "place-of-maximum"},
    "dead centre": {"dead_centre": "D", "as": "place-of-minimum"},
    "stroke": {"stroke": "D"},
    "time ratio": {"time_ratio": "D"},
    "path": {"path_error": "coupler.E"},
    "straightness": {"straightness": "coupler.E"},
    "dwell": {"angle": "rocker", "as": "dwell", "within": ["80 deg", "100 deg"]},
    "mean": {"effort": "A", "as": "mean"},
    "efficiency": {"efficiency": "cycle"},
    "reaction": {"reaction": "B", "as": "largest"},
    "at": {"angle": "rocker", "at": "50 deg"},
}


@pytest.mark.parametrize("rule", RULES)
def test_a_study_is_that_of_the_compiled_engine(stand: StandIn, rule: str) -> None:
    """Figures of every kind, those reduced on the device and those that are copied from it."""
    alike(with_measures(measure=RULES[rule]))
    assert "cuLaunchKernel" in stand.calls


def test_several_measures_at_once_by_even_points(stand: StandIn) -> None:
    some = {name.replace(" ", "-"): RULES[name] for name in ("deviation", "stroke", "mean", "reaction")}
    alike(with_measures(**some), methods=["quasi-monte-carlo"], samples=1000)


def test_a_link_turned_in_space(stand: StandIn) -> None:
    """Measures of which the name of one begins that of another."""
    data = trunnion.read(EXAMPLES / "toleranced-rssr.yaml").data()
    measures = {"turn": {"angle": "rod", "axis": "x"}, "turn again": {"angle": "rod", "axis": "y", "as": "maximum"}}
    alike(Mechanism(**{**data, "measures": measures}))


def test_samples_that_fail_are_those_of_the_compiled_engine(stand: StandIn) -> None:
    """Positions that cannot be assembled, and those beside them, are decided by NumPy and put back on the device."""
    wide = {
        name: {"limits": limits, "distribution": "uniform"} for name, limits in (("l1", "±40 mm"), ("l4", "±15 mm"))
    }
    mechanism = with_measures(wide, angle={"angle": "rocker", "as": "maximum"}, path=RULES["path"], mean=RULES["mean"])
    alike(mechanism)
    assert (
        trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=400, steps=72, engine="gpu")["failed"].sum() > 9
    )


def test_blocks_in_several_threads(stand: StandIn) -> None:
    """More than one block has the same counts, whatever thread drew it."""
    mechanism = trunnion.read(TOLERANCED)
    found = [
        trunnion.tolerance(mechanism, ["rocker-angle"], ["monte-carlo"], 120_000, steps=36, jobs=jobs, engine="gpu")
        for jobs in (1, 2)
    ]
    for name in found[0].variables:
        np.testing.assert_array_equal(found[0][name].values, found[1][name].values, err_msg=name)


def test_shares_by_a_device(stand: StandIn) -> None:
    mechanism, told = trunnion.read(TOLERANCED), {"methods": ["sobol"], "samples": 700, "steps": 36}
    found, expected = (trunnion.tolerance(mechanism, engine=engine, **told) for engine in ("gpu", "compiled"))
    for name in ("first_order", "total_order"):
        np.testing.assert_allclose(found[name].values, expected[name].values, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [("fmul double", "fadd double", "the figures of"), ("i32 1 monotonic", "i32 2 monotonic", "the counts of")],
)
def test_a_reduction_that_errs_is_refused(
    stand: StandIn, monkeypatch: pytest.MonkeyPatch, right: str, wrong: str, told: str
) -> None:
    def changed(text: str) -> bytes:
        assert right in text or '@"bins"' not in text
        return as_text(text.replace(right, wrong) if '@"bins"' in text else text)

    monkeypatch.setattr(device, "ptx", changed)
    with pytest.raises(MechanismError, match=f"other numbers than NumPy for {told} 'rocker-angle'"):
        trunnion.tolerance(trunnion.read(TOLERANCED), ["rocker-angle"], ["monte-carlo"], 100, steps=36, engine="gpu")


def test_reductions_are_ptx(tmp_path: Path) -> None:
    text = device.ptx(reductions()).rstrip(b"\0").decode()
    assert sorted(re.findall(r"\.entry (\w+)\(", text)) == sorted(NAMES)
    assemble(text, tmp_path)


def test_the_benchmark_runs(
    stand: StandIn, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmarks.gpu, "JOBS", (("durango-fourbar", True),))
    monkeypatch.setattr(benchmarks.gpu, "ptx", ptx)
    benchmarks.gpu.main(["--rounds", "1", "--configurations", "7200"])
    *_, last = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"\| durango-fourbar, friction \|( [\d.]+ \|){4}( \d+% \|){2}", last)


def test_operations_are_counted() -> None:
    """A product and a sum at once are two."""
    graph = Graph()
    x = graph.input("x", BOTH)
    node = graph.apply("div", graph.apply("sqrt", graph.apply("add", graph.apply("mul", x, x), x)), x)
    assert benchmarks.gpu.operations(program(graph, [node], 1, threads=True)) == 5


@gpu
def test_a_gpu_gives_what_the_processor_gives() -> None:
    """Where there is one."""
    alike(trunnion.read(TOLERANCED), samples=20_000)
