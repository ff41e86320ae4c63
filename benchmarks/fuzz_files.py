"""The files that are damaged, and what is done with each kind: what the verbs do with a file of strangers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from benchmarks.fuzz_damage import Entries, damaged_bytes, damaged_entries, damaged_lines, damaged_texts

__all__ = ["KINDS", "Original", "damaged", "originals"]

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
FEW = 12  # conditions of a rig that are looked at
MANY = 1_000_000  # rows of its files, from which they are not made
STEPS, CHECKED = 4, 24  # positions
# Beside `check` and `analyse`, one of these is asked of one in so many models that still pass.
ONE_IN = 6


@dataclass(frozen=True)
class Original:
    """A file that is sound: of which kind, how its name ends, its bytes, its entries if it has any.

    beside: files that stand beside it while it is read.
    """

    kind: str
    name: str
    suffix: str
    raw: bytes
    entries: Entries | None = None
    beside: dict[str, bytes] = field(default_factory=dict)

    def file(self, folder: Path) -> Path:
        """Where it is read from."""
        return folder / f"damaged{self.suffix}"


# ---- what is done with them -----------------------------------------------------------------------------------


def model(path: Path, rng: Random) -> Iterator[None]:
    """Check, then analyse at a few positions; now and then another verb, and writing it again."""
    import trunnion

    mechanism = trunnion.read(path)
    trunnion.check(mechanism, CHECKED)
    yield
    trunnion.analyse(mechanism, STEPS)
    yield
    if rng.randrange(ONE_IN) == 0:
        rng.choice(VERBS)(mechanism)
        yield
    if rng.randrange(ONE_IN) == 0:
        mechanism.write(path.with_name("again.yaml"))
        trunnion.read(path.with_name("again.yaml"))
        yield


def _design(mechanism: Any) -> None:
    from trunnion.studies.design import report_figures

    report_figures(mechanism, 0.05)


def _locking(mechanism: Any) -> None:
    from trunnion.cycle.locking import look
    from trunnion.solve.run import prepare

    look(prepare(mechanism), STEPS)


def _assemble(mechanism: Any) -> None:
    from trunnion import assemble

    assemble(mechanism, STEPS)


def _play(mechanism: Any) -> None:
    from trunnion import play

    play(mechanism, steps=STEPS)


def _tolerance(mechanism: Any) -> None:
    from trunnion import tolerance

    tolerance(mechanism, methods=("linear", "monte-carlo"), samples=20, steps=STEPS)


def _report(mechanism: Any) -> None:
    from trunnion import analyse, report

    report(analyse(mechanism, STEPS))


def _saved(mechanism: Any) -> None:
    import tempfile

    from trunnion import analyse, save

    result = analyse(mechanism, STEPS)
    with tempfile.TemporaryDirectory() as folder:
        for end in ("csv", "json", "nc"):
            save(result, Path(folder) / f"result.{end}")


VERBS: tuple[Callable[[Any], None], ...] = (_design, _locking, _assemble, _play, _tolerance, _report, _saved)


def points(path: Path, rng: Random) -> Iterator[None]:
    """A driver or a table of a model by a CSV file: the model that stands beside it is the one that it is for."""
    import trunnion
    from trunnion.model.mechanism import read_mechanism

    name, of = (
        ("A", "fourbar.yaml") if b"angle" in path.with_name("made.csv").read_bytes() else ("pressure", "press.yaml")
    )
    trunnion.analyse(read_mechanism(path.with_name(of), {name: str(path)}), STEPS)
    yield


def samples(path: Path, rng: Random) -> Iterator[None]:
    """A number that varies as a CSV file has it."""
    import trunnion

    mechanism = trunnion.read(path.with_name("fourbar.yaml")).with_samples("l3", path)
    trunnion.tolerance(mechanism, methods=("linear", "monte-carlo"), samples=20, steps=STEPS)
    yield


def mapping(path: Path, rng: Random) -> Iterator[None]:
    """A mapping, and the data that it names."""
    from trunnion.rig import read as read_measured
    from trunnion.rig.reading.measurement import dataset

    dataset(read_measured(path))
    yield


def data(path: Path, rng: Random) -> Iterator[None]:
    """Measured data, by a mapping that is sound."""
    from trunnion.rig import read as read_measured
    from trunnion.rig.reading.measurement import dataset

    dataset(read_measured(path.with_name("mapping.yaml"), [path]))
    yield


def rig(path: Path, rng: Random) -> Iterator[None]:
    """A rig put to the model that it is for."""
    import trunnion
    from trunnion.rig.virtual.rig_file import Rig

    stated = Rig.read(path)
    if len(stated.schedule.rows()) <= FEW:
        observed = trunnion.rig.observe(trunnion.read(path.with_name("fourbar.yaml")), stated)
        for _ in observed.records() if observed.rows < MANY else ():
            pass
    yield


# Each yields behind what one command of the program would do.
KINDS: dict[str, Callable[[Path, Random], Iterator[None]]] = {
    "model": model,
    "points": points,
    "samples": samples,
    "mapping": mapping,
    "data": data,
    "rig": rig,
}


# ---- originals ------------------------------------------------------------------------------------------------


@cache
def originals(kind: str) -> tuple[Original, ...]:
    """The sound files of a kind."""
    return tuple(MAKERS[kind]())


def _models() -> Iterator[Original]:
    for path in sorted(EXAMPLES.glob("*.yaml")):
        yield from _stated("model", path, {})
    for path in (EXAMPLES / "durango-fourbar.yaml", EXAMPLES / "rssr.yaml"):
        text = toml(entries(path.read_text("utf-8")))
        yield Original("model", f"{path.stem} (TOML)", ".toml", text.encode())


def _stated(kind: str, path: Path, beside: dict[str, bytes]) -> Iterator[Original]:
    raw = path.read_bytes()
    yield Original(kind, path.stem, path.suffix, raw, entries(raw.decode("utf-8")), beside)


def entries(text: str) -> Entries:
    """What a YAML file states."""
    from ruamel.yaml import YAML

    found: Entries = json.loads(json.dumps(YAML(typ="safe", pure=True).load(text)))
    return found


def toml(data: Entries) -> str:
    """Entries as TOML, lists and groups below the sections on one line."""
    lines = [f"{json.dumps(key)} = {_inline(value)}" for key, value in data.items() if not isinstance(value, dict)]
    for key, value in data.items():
        if isinstance(value, dict):
            lines += ["", f"[{json.dumps(key)}]"]
            lines += [f"{json.dumps(name)} = {_inline(one)}" for name, one in value.items()]
    return "\n".join(lines) + "\n"


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_inline(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_inline, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


DRIVEN = {"law": "table", "points": [["0 s", "0 deg"], ["0.5 s", "90 deg"], ["1 s", "0 deg"]]}


def _fourbar(changes: Entries | None = None) -> bytes:
    """A four-bar with tolerances as JSON, which is YAML."""
    found = entries((EXAMPLES / "toleranced-fourbar.yaml").read_text("utf-8"))
    return json.dumps({**found, **(changes or {})}).encode()


def _press() -> bytes:
    return (EXAMPLES / "slider-crank.yaml").read_bytes()


def _points() -> Iterator[Original]:
    beside = {"fourbar.yaml": _fourbar({"drivers": {"A": DRIVEN}}), "press.yaml": _press()}
    time, angle = np.linspace(0, 1, 25), np.linspace(0, 360, 37)
    motion = list(zip(time, 90 * np.sin(np.pi * time) ** 2, strict=True))
    gas = list(zip(angle, 8 * np.cos(np.pi * angle / 360) ** 8, strict=True))
    made = {
        "times and angles": _rows(["t [s]", "angle [deg]"], motion, ","),
        "decimal commas": _rows(["t [s]", "angle [deg]"], motion, ";", ","),
        "pressures": _rows(["drive [deg]", "p [bar]"], gas, ","),
    }
    for name, raw in made.items():
        yield Original("points", name, ".csv", raw, None, {**beside, "made.csv": raw})


def _samples() -> Iterator[Original]:
    beside = {"fourbar.yaml": _fourbar()}
    drawn = np.random.default_rng(3).normal(0, 0.02, 40)
    rows = [(float(f"{one:.4f}"),) for one in drawn]
    yield Original("samples", "one column", ".csv", _rows(["deviation [mm]"], rows, ","), None, beside)
    yield Original("samples", "decimal commas", ".csv", _rows(["deviation [mm]"], rows, ";", ","), None, beside)


def _rows(head: list[str], rows: list[Any], sign: str, decimal: str = ".") -> bytes:
    lines = [sign.join(head)]
    lines += [sign.join(f"{cell:.7g}".replace(".", decimal) for cell in row) for row in rows]
    return ("\n".join(lines) + "\n").encode()


MAPPING: Entries = {
    "trunnion-data": 1,
    "name": "rig",
    "time": {"column": "t", "unit": "s"},
    "angle": {"from": "pulses", "column": "encoder", "per_turn": 60},
    "positions": 90,
    "channels": {
        "torque-in": {
            "column": "T1", "measures": "effort:input", "unit": "V", "gain": "100 mV/(N m)",
            "zero": {"over": ["0 s", "0.19 s"]}, "accuracy": {"gain": "0.1 %", "zero": "5 mN m"},
        },
        "speed-in": {"column": "n1", "measures": "rate:input", "unit": "rpm"},
        "brake": {"column": "T2", "measures": "load:brake", "unit": "N m"},
    },
    "drift": "remove",
    "filter": {"cut_off": "200 Hz"},
}  # fmt: skip


@cache
def _recorded() -> dict[str, Any]:
    """Eight turns at 600 rpm after 0.2 s at rest, 1000 readings a second."""
    rng = np.random.default_rng(1)
    t = np.arange(1000) / 1000
    runs = t >= 0.2
    angle = np.where(runs, 20 * np.pi * (t - 0.2), 0.0) + 0.37
    columns = {
        "t": t,
        "T1": 0.1 * np.where(runs, 20 + 5 * np.sin(angle), 0.0) + 0.005 * rng.normal(size=t.size) + 0.05,
        "T2": np.where(runs, 18 + 4 * np.sin(angle + 0.3), 0.0) + 0.05 * rng.normal(size=t.size),
        "n1": np.where(runs, 600.0, 0.0) + 0.05 * rng.normal(size=t.size),
        "encoder": np.floor(angle / (2 * np.pi) * 60),
        "phi": angle * 180 / np.pi,
        "speed set": np.where(t < 0.6, 600.0, 599.0),
    }
    return {name: np.round(values, 6) for name, values in columns.items()}


@cache
def _data_files() -> dict[str, bytes]:
    """The recording in each format, by the name of its file."""
    import io

    import pandas as pd
    from nptdms import ChannelObject, TdmsWriter

    columns = _recorded()
    frame = pd.DataFrame(columns)
    parquet, tdms = io.BytesIO(), io.BytesIO()
    frame.to_parquet(parquet)
    with TdmsWriter(tdms) as writer:
        writer.write_segment([ChannelObject("rig", name, values) for name, values in columns.items()])
    units = {"t": "s", "T1": "V", "T2": "N m", "n1": "rpm", "phi": "deg"}
    german = frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})
    return {
        "run.csv": frame.to_csv(index=False).encode(),
        "german.csv": german.to_csv(index=False, sep=";", decimal=",").encode("cp1252"),
        "run.parquet": parquet.getvalue(),
        "run.tdms": tdms.getvalue(),
        **{f"{engine}.nc": bytes(frame.to_xarray().to_netcdf(engine=engine)) for engine in ("scipy", "h5netcdf")},
    }


def _mappings() -> Iterator[Original]:
    files = {name: raw for name, raw in _data_files().items() if name != "german.csv"}
    first = {**MAPPING, "files": [{"file": "run.csv", "set": {"input.speed": "600 rpm"}}]}
    other = {
        **MAPPING,
        "angle": {"from": "column", "column": "phi", "unit": "deg"},
        "files": [{"file": "run.parquet"}, {"file": "run.tdms", "over": ["0.1 s", "0.9 s"]}],
    }
    for name, stated in (("pulses", first), ("angle", other)):
        text = _yaml(stated)
        yield Original("mapping", name, ".yaml", text.encode(), stated, files)


def _yaml(data: Entries) -> str:
    import io

    from ruamel.yaml import YAML

    stream, yaml = io.StringIO(), YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.dump(data, stream)
    return stream.getvalue()


def _data() -> Iterator[Original]:
    beside = {"mapping.yaml": json.dumps(MAPPING).encode()}
    for name, raw in _data_files().items():
        yield Original("data", name, Path(name).suffix, raw, None, beside)


def _rigs() -> Iterator[Original]:
    beside = {"fourbar.yaml": _fourbar()}
    yield from _stated("rig", EXAMPLES / "rig" / "fourbar-rig.yaml", beside)


MAKERS: dict[str, Callable[[], Iterator[Original]]] = {
    "model": _models,
    "points": _points,
    "samples": _samples,
    "mapping": _mappings,
    "data": _data,
    "rig": _rigs,
}


# ---- damage ---------------------------------------------------------------------------------------------------


def damaged(original: Original, rng: Random) -> bytes:
    """The bytes of a file with something wrong in it, or now and then with nothing."""
    text = original.raw.decode("utf-8", "surrogateescape")
    binary = original.suffix in (".parquet", ".tdms", ".nc")
    way = rng.random()
    if original.entries is not None and way < 0.6:
        stated = damaged_entries(original.entries, rng)
        return json.dumps(stated, ensure_ascii=rng.random() < 0.5).encode("utf-8", "surrogatepass")
    if binary or way < 0.75:
        return damaged_bytes(original.raw, rng)
    change = damaged_lines if way < 0.85 else damaged_texts
    return change(text, rng).encode("utf-8", "surrogateescape" if binary else "surrogatepass")
