"""A result of any kind as a report or a figure: which view it has."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from inspect import signature
from typing import TYPE_CHECKING, Any

import xarray as xr

from trunnion.errors import Finding, MechanismError
from trunnion.model.arguments import check_keywords, strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import whole
from trunnion.results.tables import kind_of
from trunnion.views.charts import check_kind as one_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from trunnion.views.cycle.report import Animation

__all__ = ["animation_of", "check_kind", "figure_of", "html_of", "plot", "report", "report_of"]

# kind of result: the modules in which its `figure` and its `report` stand; loaded when they are asked for, for
# matplotlib is slow to import
VIEWS = {
    "cycle": ("cycle.plots", "cycle.report"), "motion": ("motion.figure", "motion.report"),
    "sweep": ("sweep", "sweep"), "play": ("play", "play"), "assembly": ("assembly.figure", "assembly.figure"),
    "tolerance": ("tolerance", "tolerance"), "allocation": ("allocation", "allocation"),
    "comparison": ("compare", "compare"), "identification": ("identify", "identify"),
}  # fmt: skip


@strict_arguments
def plot(of: Mechanism | xr.Dataset, kind: str | None = None, **options: Any) -> Figure:
    """A matplotlib Figure of a mechanism at its start, or of a result.

    kind: of a result one of the figures of its view, such as "reactions" of a cycle (`trunnion plot --help` lists
    them); the main one if not given. options: those of the figure, as ideal= (the same run without friction) of a
    cycle. Raises MechanismError for a kind that there is not, or where there is nothing to draw.
    """
    if not isinstance(of, Mechanism):
        return figure_of(of, kind, **options)
    if kind is not None or options:
        raise MechanismError(Finding("a mechanism has one drawing", "kind", "analyse it first, and plot the result"))
    return of.plot()


@strict_arguments
def report(result: xr.Dataset, ideal: xr.Dataset | None = None, **options: Any) -> str:
    """The report of a result as one HTML page that needs no network.

    ideal: of a cycle, the same run without friction, drawn beside; options: others of its report. Raises MechanismError
    of a result that has no report, ValueError if `ideal` has other positions.
    """
    return report_of(result, **(options if ideal is None else {"ideal": ideal, **options}))


def report_of(result: xr.Dataset, **options: Any) -> str:
    """The report of a result as HTML. options: those of its view, such as ideal= of a cycle."""
    view = _view(result, "report")
    return str(_called(view.report, f"report() of a {kind_of(result)}", result, options))


def figure_of(result: xr.Dataset, kind: str | None = None, **options: Any) -> Figure:
    """A figure of a result; kind: of those of its view, the main one if not given; options: those of its view."""
    view, call = _view(result, "figure"), f"plot() of a {kind_of(result)}"
    if kind is None:
        return _called(getattr(view, "sheet", view.figure), call, result, options)  # type: ignore[no-any-return]
    if "kind" not in signature(view.figure).parameters:
        what, remedy = f"a result of {kind_of(result)} has one figure", "leave the kind out"
        raise MechanismError(Finding(what, "kind", remedy))
    return _called(view.figure, call, result, {"kind": kind, **options})  # type: ignore[no-any-return]


def _called(view: Callable[..., Any], call: str, result: xr.Dataset, options: Mapping[str, Any]) -> Any:
    """What the function of a view makes of a result; TypeError for an option that it does not have."""
    _, *parameters = signature(view).parameters
    check_keywords(call, options, parameters)
    return view(result, **options)


def animation_of(result: xr.Dataset, ideal: xr.Dataset | None, height: int) -> Animation:
    """The moving mechanism of a cycle."""
    if kind_of(result) != "cycle":
        raise MechanismError(Finding(f"there is no animation of a {kind_of(result)}", "kind", "analyse a cycle"))
    return _view(result, "animation").animation(result, ideal, height)  # type: ignore[no-any-return]


def html_of(result: xr.Dataset) -> str:
    """What a notebook shows of a result of any kind."""
    return str(import_module("trunnion.views.notebook").result_html(result))


def check_kind(of: str, kind: str) -> None:
    """MechanismError if a result of some kind (`of`) has no such kind of figure."""
    one_of(kind, import_module(f"trunnion.views.{VIEWS[of][0]}").KINDS)


def _view(result: xr.Dataset, what: str) -> Any:
    """The module of the view of a whole result."""
    whole(result, f"a {what}")
    if kind_of(result) not in VIEWS:
        remedy = f"there are {what}s of {', '.join(VIEWS)}"
        raise MechanismError(Finding(f"there is no {what} of a {kind_of(result)}", "kind", remedy))
    return import_module(f"trunnion.views.{VIEWS[kind_of(result)][what != 'figure']}")
