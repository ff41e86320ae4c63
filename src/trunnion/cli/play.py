"""`trunnion play`: what the play of every joint does to measures."""

from __future__ import annotations

from typing import Any

from trunnion.cli.files import verb
from trunnion.cli.options import Files, Measures, Model, OnePosition, Steps, Uncut
from trunnion.cli.result import Shown, check_files
from trunnion.errors import Finding, MechanismError

__all__ = ["play"]


@verb(lacks="seat columns")
def play(
    model: Model,
    files: Files,
    measure: Measures = None,
    steps: Steps = 360,
    at: OnePosition = None,
    uncut: Uncut = False,
) -> None:
    """Effect of the play of each joint on measures.

    Worst case, share of each joint, standard deviation.
    """
    from trunnion.studies.play import play as run
    from trunnion.views.common.peaks import whole_peaks
    from trunnion.views.play import MOST_PANELS, figure, tables

    check_files(files)
    mechanism = model.read()
    with model.lines():
        result = run(mechanism, measure, steps, at)
    pictured = whole_peaks(result, uncut)

    def draw(path: object) -> Any:
        if result.sizes["measure"] > MOST_PANELS:
            what = f"{result.sizes['measure']} measures do not fit one figure"
            raise MechanismError(Finding(what, str(path), f"name at most {MOST_PANELS} by --measure"))
        return figure(pictured)

    Shown(result, model, files, "measures joints", pictured, draw=draw, tables=tables(result), apart=False).finish()
