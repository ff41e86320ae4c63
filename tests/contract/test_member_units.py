"""Where the members of a variable have units of their own, the variable says so, and a coordinate has that of each."""

import csv

import pytest
import xarray as xr

import trunnion
from mechanisms import excavator, model, slider_crank
from mechanisms_space import draw
from trunnion import Mechanism
from trunnion.results.dataset import unit_of, units_along
from trunnion.results.save import save
from trunnion.results.tables import columns

MIXED = {"S": "N", "K": "N m"}
COORDINATES = {"S": "m", "K": "rad"}


def mixed(space):
    """A cylinder S and a motor K, each with a driver."""
    if space == "spatial":
        return Mechanism(**draw(3, "ground =S= slide -K- hand", ("S", "K")).data)
    data = excavator()
    data["joints"]["C"]["pin"] = {"radius": 0.01, "clearance": 1e-4, "length": 0.03}
    data["springs"] = {
        "coil": {"between": ["ground.B", "boom.K"], "stiffness": 10.0, "free_length": 1.0},
        "torsion": {"joint": "K", "stiffness": 2.0, "free_angle": 0.1},
    }
    data["measures"] = {
        "push": {"effort": "S", "as": "maximum"},
        "turn": {"effort": "K", "as": "maximum"},
        "swing": {"angle": "boom"},
    }
    data["dimensions"] = {"reach": "0.9 m"}
    data["links"]["boom"]["points"]["C"] = ["reach", 0.15]
    data["tolerances"] = {"reach": 1e-3, "joint_defaults.friction.coefficient": 0.01}
    return Mechanism(**model(data))


def of_each(variable, dim):
    """The unit of every member, which is the coordinate's where there are several."""
    units = dict(zip(variable[dim].values.tolist(), units_along(variable, dim), strict=True))
    assert variable.attrs["units"] == " or ".join(dict.fromkeys(units.values()))
    for member, unit in units.items():
        assert unit_of(variable.sel({dim: member})) == unit
    if len(set(units.values())) > 1:
        assert variable[variable.attrs["units_of_each"]].values.tolist() == list(units.values())
    return units


@pytest.mark.parametrize("space", ["planar", "spatial"])
def test_efforts_of_mixed_drivers(space):
    result = trunnion.locking(mixed(space), 6)
    for end in ("", "_lower", "_upper", "_rms", "_reverse"):
        assert of_each(result[f"drive_effort{end}"], "driver") == MIXED
    flat = {name: unit for name, unit, _ in columns(result)}
    assert {name: flat[f"{name}.effort"] for name in MIXED} == MIXED


@pytest.mark.parametrize(("driver", "unit"), [("A", "N m"), ("C", "N")])
def test_drivers_of_one_kind_have_one_unit_and_no_more_coordinates(driver, unit):
    data = slider_crank()
    data["drivers"] = {driver: {"speed": 0.1, "range": [0.8, 1.1]}}
    result = trunnion.analyse(Mechanism(**model(data)), 6)
    assert result["drive_effort"].attrs["units"] == result["drive_effort_rms"].attrs["units"] == unit
    assert not [name for name in result.coords if str(name).endswith("_unit")]


def moving():
    data = excavator()
    data["drivers"]["S"] |= {"free": True}
    return Mechanism(**model(data))


EFFORTS = {f"drive_effort_{end}": ("driver", MIXED) for end in ("min", "max", "rms")}
RATES = {name: f"{unit}/s" for name, unit in COORDINATES.items()}
MEASURES = {"push": "N", "turn": "N m", "swing": "rad"}
PLAYED = {"effort:S": "N", "effort:K": "N m", "angle:boom": "rad"}
STUDIES = {
    "cycle": (lambda: trunnion.analyse(mixed("planar"), 6), {
        "spring_force": ("spring", {"coil": "N", "torsion": "N m"}), "measure_value": ("measure", MEASURES),
        "spring_elongation": ("spring", {"coil": "m", "torsion": "rad"}), "measure_figure": ("measure", MEASURES)}),
    "sweep": (lambda: trunnion.sweep(
        mixed("planar").with_values({"joints.C.seat": {"xi": 0.5}}), {"reach": [0.9, 0.91]}, steps=6), EFFORTS | {
        "transmission_error_max": ("joint", {**dict.fromkeys("ABCK", "rad"), "S": "m"})}),
    "time": (lambda: trunnion.simulate(moving(), 0.02, steps=4), {
        "drive_effort": ("driver", MIXED), "drive_coordinate": ("driver", COORDINATES),
        "drive_rate": ("driver", RATES)}),
    "play": (lambda: trunnion.play(mixed("planar"), measures=list(PLAYED), steps=6), {
        "worst_case_total": ("measure", PLAYED),
        "sensitivity": ("measure", {name: f"{unit}/m" for name, unit in PLAYED.items()})}),
    "tolerance": (lambda: trunnion.tolerance(mixed("planar"), ["push", "turn"], methods=["linear"], steps=6), {
        "rss": ("measure", {"push": "N", "turn": "N m"})}),
    "assembly": (lambda: trunnion.assemble(mixed("planar"), 6), {"drive_coordinate": ("driver", COORDINATES)}),
}  # fmt: skip


@pytest.mark.sample(15)
@pytest.mark.spread(2)
@pytest.mark.parametrize("study", STUDIES)
def test_members_have_the_units_of_each(study):
    made, wanted = STUDIES[study]
    result = made()
    for name, (dim, units) in wanted.items():
        assert of_each(result[name], dim) == units
    flat = {name: unit for name, unit, _ in columns(result)}
    heads = {"sweep": {"S.effort_max": "N"}, "time": {f"{name}.coordinate": unit for name, unit in COORDINATES.items()}}
    assert heads.get(study, {}).items() <= flat.items()
    if study == "tolerance":
        assert set(of_each(result["parameter_nominal"], "parameter").values()) == {"m", "1"}
        assert result["sensitivity"].attrs["units"] == "(N or N m)/(m or 1)"


@pytest.mark.spread(1)
@pytest.mark.parametrize("ending", ["nc", "zarr", "json"])
def test_files_keep_the_unit_of_each(ending, tmp_path):
    readers = {"nc": xr.load_dataset, "zarr": xr.open_zarr}
    path = tmp_path / f"x.{ending}"
    if ending == "zarr":
        pytest.importorskip("zarr")
    save(trunnion.analyse(mixed("planar"), 6), path)
    if ending in readers:
        assert of_each(readers[ending](path)["drive_effort"], "driver") == MIXED
    else:
        assert '"effort_unit"' in path.read_text()


def test_the_units_row_has_the_unit_of_each(tmp_path):
    path = tmp_path / "x.csv"
    save(trunnion.analyse(mixed("planar"), 6), path, units_row=True)
    with path.open() as file:
        names, units = (next(rows) for rows in [csv.reader(file)] * 2)
    row = dict(zip(names, units, strict=True))
    meant = {"S.effort": "N", "K.effort": "N m", "coil.force": "N", "torsion.force": "N m", "torsion.elongation": "rad"}
    assert {name: row[name] for name in meant} == meant
