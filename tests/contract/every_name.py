"""A script of a user with every public name, for the type checker; it is not run."""

from pathlib import Path
from typing import reveal_type

import xarray as xr
from matplotlib.figure import Figure

import trunnion


def single(path: Path) -> None:
    """One mechanism, question by question."""
    try:
        mechanism: trunnion.Mechanism = trunnion.read(path)
    except trunnion.MechanismError as error:
        print([finding.code for finding in error.findings])
        raise
    settled = trunnion.FrictionMethod("successive-approximation", criterion=1e-3)
    found = trunnion.check(mechanism, steps=36)
    reveal_type(found.formula)
    reveal_type(found.findings)
    cycle = trunnion.analyse(mechanism, steps=72, friction_method=settled, progress=print)
    reveal_type(cycle)
    good: bool = int(cycle["status"].max()) < trunnion.Status.NOT_CONVERGED
    figure: Figure = trunnion.plot(cycle, "reactions")
    drawing: Figure = trunnion.plot(mechanism)
    same: Figure = mechanism.plot()
    page: str = trunnion.report(cycle, ideal=trunnion.analyse(mechanism.with_friction("off"), steps=72))
    trunnion.save(cycle, path.with_suffix(".csv"), units_row=True, columns=["motion", "A.effort"])
    reveal_type(trunnion.design(mechanism))
    print(good, figure, drawing, same, len(page))


def studies(mechanism: trunnion.Mechanism) -> list[xr.Dataset]:
    """Every study."""
    return [
        trunnion.locking(mechanism, steps=36),
        trunnion.assemble(mechanism, steps=36, uniform="all"),
        trunnion.simulate(mechanism, 0.1, steps=10),
        trunnion.sweep(mechanism, {"AB": ("1 m", "2 m", 5)}, steps=36),
        trunnion.play(mechanism, ["effort:A"], steps=36),
        trunnion.tolerance(mechanism, methods=("linear",), jobs=1),
        trunnion.allocate(mechanism, criterion="yield", target=0.99, samples=0),
    ]


def exchange(mechanism: trunnion.Mechanism, step: Path) -> str:
    """Files of other programs."""
    draft: trunnion.exchange.Draft = trunnion.exchange.import_file(step, ground="frame", material="aluminium")
    bodies: list[trunnion.exchange.Body] = list(draft.bodies.values())
    pairs: list[trunnion.exchange.Pair] = list(draft.pairs.values())
    lost = trunnion.exchange.export_model(mechanism, step.with_suffix(".xml"), at="60 deg", frames=12)
    print(bodies, pairs, lost, sorted(trunnion.exchange.FORMATS))
    return trunnion.exchange.model_text(draft)


def rig(mechanism: trunnion.Mechanism, plan: Path, mapping: Path) -> tuple[xr.Dataset, xr.Dataset]:
    """Measured data."""
    seen: trunnion.rig.Observation = trunnion.rig.observe(mechanism, plan, seed=2)
    reveal_type(seen.write(mapping.parent))
    measured: trunnion.rig.Measurement = trunnion.rig.read(mapping)
    compared = trunnion.rig.compare(mechanism, measured, coverage=2.0)
    fitted = trunnion.rig.identify(mechanism, measured, ["A.friction.coefficient"])
    reveal_type(fitted)
    return compared, fitted


print(trunnion.__version__)
