"""The main question: how does it move, what force is in each joint, what drives it, where does the power go."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.cycle_kernel import Engine
from trunnion.cycle.positions import ALL, Dtype, Kept, check_steps, positions
from trunnion.cycle.scene import scene_of
from trunnion.cycle.summary import member_units, result_of
from trunnion.errors import Finding, MechanismError
from trunnion.measures.positions import place_of, time_of
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import TableUnits
from trunnion.results import variables as results
from trunnion.results.attributes import origin
from trunnion.results.dataset import Result, driven
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

if TYPE_CHECKING:
    import xarray as xr

DRAWN = 72  # positions of the curves of points that are drawn


@strict_arguments
@np.errstate(all="ignore")
def analyse(
    mechanism: Mechanism,
    steps: int = 360,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    engine: Engine = "auto",
    variables: Sequence[str] | None = None,
    dtype: Dtype = "float64",
    out: str | os.PathLike[str] | Sequence[str | os.PathLike[str]] = (),
    units_row: bool = False,
    columns: Sequence[str] | None = None,
    units: TableUnits = "si",
    at: float | str | None = None,
) -> xr.Dataset:
    """Motion, reactions with friction, drive effort and power of a mechanism over its cycle.

    steps: equally spaced positions; over a full turn the end is not repeated. Returns a Dataset with the names,
    units and dims of `results.VARIABLES`; positions without an answer are NaN and have a status.
    friction_method: how friction and reactions are settled; Newton's method if not given.
    progress: called with the number of positions done. engine: numpy, compiled (machine code, which pays
    from some 10⁵ positions on, where locking margins are followed from some 10³ on), or auto: compiled where it
    pays and can do the mechanism.
    variables: names of those that the Dataset has beside the status, all if not given; the summary and the findings
    are the same, but for the locking margin and what decides it, which are found only where it is named. dtype:
    float64, or float32 for a Dataset of half the size; what is computed is float64 in any case.
    at: one position instead of all, such as "60 deg", or in SI, 1.05; the summary and the means are those of the cycle.
    out: files to write, as by `save`, with its arguments units_row, columns and units.
    Method: the modules' closed forms or the general group, friction settled per module (`friction.settle`).
    Raises MechanismError if the structure does not determine the motion, `steps` is out of range, a variable is
    unknown, the engine cannot do the mechanism, or there is no file for what is said of tables.
    """
    from trunnion.results.save import check_format, save

    selection = Kept.read(variables, dtype)
    paths = [out] if isinstance(out, (str, os.PathLike)) else out
    saved = {"units_row": units_row, "columns": columns, "units": units}
    unused = [key for key, value in saved.items() if value not in (False, None, "si") and not paths]
    if unused:
        raise MechanismError(Finding("has no effect without a file to write", unused[0], "give out too"))
    for path in paths:
        check_format(path)
    result = analysed(mechanism, steps, friction_method, progress, engine, selection, at).dataset
    for path in paths:
        save(result, path, **saved)  # type: ignore[arg-type]  # it checks them
    return result


@strict_arguments
@np.errstate(all="ignore")
def analysed(
    mechanism: Mechanism,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    engine: Engine = "auto",
    selection: Kept = ALL,
    at: float | str | None = None,
) -> Result:
    """What `analyse` does, before it becomes a Dataset."""
    check_steps(steps)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    time = None
    if at is not None:
        place, timed = place_of(run.system.mechanism, at)
        if run.cycle.duration <= 0:
            raise MechanismError(Finding("nothing moves: there is one position", "at", "remove at"))
        time = time_of(run, place, timed, "at")
    at_positions = positions(
        run, steps, method, progress, selection.margin, engine=engine, wanted=selection.variables, at=time
    )
    return result_of(run, at_positions, selection)


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN
def drawable(mechanism: Mechanism) -> xr.Dataset:
    """The motion alone over a cycle of DRAWN positions, to draw it: no friction, no seats by loads, no course.

    Raises MechanismError if the structure does not determine the motion.
    """
    bare = mechanism.with_friction("off")
    run = prepare(bare.with_seats("free") if bare.seated else bare)
    places = positions(run, DRAWN, margin=False, averaged=False)
    arrays = {name: array for name, array in places.arrays.items() if not name.startswith("reaction_")}
    attributes = {
        **origin(mechanism, run.system.plan.formula, mobility=run.system.plan.mobility),
        "scene": scene_of(run),
        "periodic": int(run.cycle.periodic),
    }
    along = driven(places.time, *places.dial)
    units = member_units(run.system)
    return results.dataset(arrays, places.labels, along, places.means, attributes, units, places.ideal)
