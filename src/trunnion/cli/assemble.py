"""`trunnion assemble`: whether the stated clearances take up the errors, and the smallest clearance that would."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from typer import Option

from trunnion.cli.files import verb
from trunnion.cli.options import Files, Model, Steps
from trunnion.cli.result import Shown, check_files
from trunnion.cli.terminal import bar

__all__ = ["assemble"]

Uniform = StrEnum("Uniform", ["pins", "all"])


@verb(lacks="table friction seat columns")
def assemble(
    model: Model, files: Files, steps: Steps = 360,
    uniform: Annotated[
        Uniform, Option("--uniform", help="Joints with one common clearance: pins, or all kinds of play.")
    ] = Uniform.pins,
) -> None:  # fmt: skip
    """Clearance needed to assemble a linkage with axis errors."""
    from trunnion.studies.assembly import assemble as run

    check_files(files)
    mechanism = model.read()
    with model.lines(), bar("positions", steps, least=1000) as progress:
        result = run(mechanism, steps, uniform.value, progress)  # type: ignore[arg-type]  # it checks it
    Shown(result, model, files, "assembly").finish()
