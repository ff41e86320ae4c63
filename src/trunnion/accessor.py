"""`result.trunnion`: what a result says and how it is shown, on the Dataset itself.

It is there as soon as a function of `trunnion` that returns a result is used; `import trunnion.accessor` brings it for
a result that is read from a file.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import xarray as xr

from trunnion.errors import Finding
from trunnion.files import whole
from trunnion.model.arguments import strict_arguments
from trunnion.model.units import TableUnits
from trunnion.results.attributes import Figure as Figure
from trunnion.results.attributes import findings_of, summary_of
from trunnion.results.save import frame, save
from trunnion.results.tables import KINDS, kind_of
from trunnion.views.shown import plot, report, result_html

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure as Drawing

    from trunnion.views.report import Animation


@xr.register_dataset_accessor("trunnion")  # type: ignore[no-untyped-call]
@strict_arguments
class Accessor:
    """A result of Trunnion, read."""

    def __init__(self, result: xr.Dataset) -> None:
        self._result = result

    def __repr__(self) -> str:
        """One line; `summary`, `findings` and `tables()` have what it holds."""
        return f"<{self.kind} of {self._result.attrs.get('name', '')!r}: {len(self.findings)} findings>"

    @property
    def kind(self) -> str:
        """What it is a result of: cycle, sweep, play, assembly, tolerance, allocation, measurement, comparison or
        identification, motion."""
        return kind_of(self._result)

    @property
    def findings(self) -> list[Finding]:
        """What is to be known of it, by code, severity, place and figures."""
        return findings_of(self._result)

    @property
    def summary(self) -> list[Figure]:
        """The figures that one looks at first, by name, value and unit."""
        return summary_of(self._result)

    def tables(self) -> dict[str, pd.DataFrame]:
        """Its tables by name, with the columns of the CSV files."""
        return {name: frame(self._result, name) for name in KINDS[self.kind]}

    def save(
        self,
        path: str | os.PathLike[str],
        units_row: bool = False,
        columns: Sequence[str] | None = None,
        units: TableUnits = "si",
    ) -> None:
        """Write it by the file's extension, as `trunnion.save` does: .csv .json .nc .zarr .parquet .xlsx."""
        save(self._result, path, units_row, columns, units)

    def report(self, path: str | os.PathLike[str] | None = None, **options: Any) -> str:
        """The report as HTML, also written if a path is given; options: those of the view, as ideal= of a cycle."""
        text = report(self._result, **options)
        if path is not None:
            with whole(path) as temporary:
                temporary.write_text(text, encoding="utf-8")
        return text

    def plot(self, kind: str | None = None, **options: Any) -> Drawing:
        """A matplotlib figure: the main one of its view, or of a kind such as "reactions"."""
        return plot(self._result, kind, **options)

    def animate(self, ideal: xr.Dataset | None = None, height: int = 760) -> Animation:
        """The moving mechanism of a cycle, which a notebook shows in its place and `.save("motion.html")` writes.

        ideal: the same run without friction, drawn beside; height: of the frame in a notebook, px. Raises
        MechanismError of a result of another kind.
        """
        from trunnion.views.report import animation

        return animation(self._result, ideal, height)

    def _repr_html_(self) -> str:
        """What a notebook shows: the figures that one looks at first, and the findings."""
        return result_html(self._result)
