"""The tables that the code generates for the pages, by the name that a page asks for them by."""

from __future__ import annotations

from collections.abc import Callable

from page_tables import calls, choices, model_file, results

__all__ = ["TABLES"]

TABLES: dict[str, Callable[..., str]] = {
    "results": results.results_table,
    "moving": results.moving_table,
    "sweeps": results.sweeps_table,
    "plays": results.plays_table,
    "tolerances": results.tolerances_table,
    "allocations": results.allocations_table,
    "identification": results.identification_table,
    "measures": choices.measures_table,
    "distributions": choices.distributions_table,
    "cost-models": choices.costs_table,
    "assembling": results.assembling_table,
    "comparisons": results.comparisons_table,
    "statuses": results.status_table,
    "laws": choices.laws_table,
    "motion": choices.motion_table,
    "motors": choices.motors_table,
    "contact_laws": choices.contact_laws_table,
    "pairs": choices.pairs_table,
    "groups": choices.groups_table,
    "plots": results.plots_table,
    "formats": results.formats_table,
    "codes": results.codes_table,
    "units": choices.units_table,
    "command-line": calls.command_line,
    "public-names": calls.public_names,
    "section": model_file.section,
}
