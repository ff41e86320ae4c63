"""What an allocation says in words: its summary, its findings, and whether the limits are kept on the mechanism."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.results.dataset import units_along
from trunnion.results.figure import Figure
from trunnion.results.sentences import finding_for
from trunnion.studies.allocation.outcome import CLOSE, DEFAULT_YIELD, share_of
from trunnion.studies.tolerance.linear import by_position
from trunnion.studies.tolerance.targets import ENOUGH, OTHERWISE, limits

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.studies.allocation.outcome import Allocated

__all__ = ["contradicted", "findings_of", "summary"]

TWICE = 2.0  # so many rejects as an RSS stands for are an error
SHOWN = {"rad": (180 / np.pi, "deg"), "m": (1e3, "mm")}
MOST = 0.5  # of the permitted failures: what one limit may use up whatever is bought
ROUGH, SLIGHT = 0.01, 0.001  # of a limit: what first order may leave out before it is an error, and a warning


def summary(found: Allocated, known: xr.Dataset, arrays: Mapping[str, Any]) -> Iterator[Figure]:
    """What all costs, and before; what of the room is taken."""
    answer = found.answer
    yield Figure("cost", "cost", answer.cost if answer.found else None, aspect="least")
    if np.isfinite(arrays["cost_total_before"]):
        yield Figure("cost_before", "cost as stated", arrays["cost_total_before"])
    if answer.found:
        yield Figure("cost_bound", "lower bound of the cost", answer.bound)
    if answer.sampled is not None:
        yield Figure("yield_asked", "required yield", found.asked.target)
        yield Figure("yield", "yield of the samples", answer.sampled.share)
    if answer.checked is not None:
        yield Figure("yield_checked", "yield of fresh samples", answer.checked.share)
    for name, used in zip(known["measure"].values.tolist(), arrays["used"].tolist(), strict=True):
        if answer.found and np.isfinite(used):
            yield Figure(f"{name}.used", f"{name}, share of the limits used", used)


def findings_of(found: Allocated, known: xr.Dataset) -> Iterator[Finding]:
    """Why there is no allocation; that it is proven; limits that are not kept on the mechanism itself."""
    answer = found.answer
    yield from found.findings
    yield from answer.findings
    if not answer.found:
        return
    otherwise = contradicted(found, known)
    yield from _optimal(found, otherwise)
    yield from _plays(found)
    for name, share in found.tight.items():
        yield finding_for("allocation.narrowed", f"measures.{name}", percent=100 * (1 - share))
    if found.asked.criterion != "yield" and found.study.effects.correlated:
        yield finding_for("allocation.correlations_left_out", "correlations", criterion=found.asked.criterion)
    if found.asked.criterion == "worst-case":
        yield from _searched(found, known, otherwise)
    if found.asked.criterion == "rss" and "yield" in known:
        yield from _promised(known)
    if found.asked.criterion == "yield" and "yield_all" in known and answer.sampled is not None:
        yield from _yielded(found, known)
    if found.asked.criterion == "yield":
        yield from _alone(found)
    kept = [factor for factor, one in found.offers if one.found]
    if len(kept) < len(found.offers):
        points, least = len(found.offers), min(kept, default=None)
        yield finding_for("allocation.curve_short", points=points, lost=points - len(kept), least=least)


def _optimal(found: Allocated, otherwise: Mapping[str, str]) -> Iterator[Finding]:
    """Of what the cost is the least, or of which measures first order tells nothing."""
    for name, told in otherwise.items():
        yield finding_for("allocation.not_linear", f"measures.{name}", phrases={"told": told})
    if otherwise or not found.answer.proven:
        return
    if found.asked.criterion == "yield":
        yield finding_for("allocation.proven_margin")
        yield from _margins(found)
    else:
        yield finding_for("allocation.proven", gap=max(found.answer.gap, 0.0))


def _margins(found: Allocated) -> Iterator[Finding]:
    """How the permitted failures are split over several limits."""
    answer, count = found.answer, len(np.unique(found.rows.measure))
    if count < 2 or any(one.code == "yield.not_normal" for one in answer.findings):
        return
    above: dict[str, Any] = {"count": count, "excess": answer.excess if np.isfinite(answer.excess) else None}
    if found.way == "discrete":
        yield finding_for("allocation.same_margin", "measures", **above)
    else:
        saved = answer.saved if np.isfinite(answer.saved) else 0.0
        yield finding_for("allocation.split_margin", "measures", saved=saved, **above)


def _plays(found: Allocated) -> Iterator[Finding]:
    """Allocated plays whose clearance has a tolerance of its own, which no cost is of."""
    for path in found.prices:
        joint = path.split(".")[1]
        sizes = [f"joints.{joint}.{part}.clearance" for part in ("pin", "guide")]
        for one in found.study.inputs.tolerances:
            if path == f"joints.{joint}.clearance" and one.path in sizes:
                ends: dict[str, Any] = {"lower_um": 1e6 * one.lower, "upper_um": 1e6 * one.upper}
                yield finding_for("allocation.play_tolerance", f"costs.{joint}.clearance", number=one.path, **ends)


def _yielded(found: Allocated, known: xr.Dataset) -> Iterator[Finding]:
    """That the samples have less than the yield asked for: an error if it is not within their interval."""
    target, any_other = found.asked.target, any(one.where == "yield" for one in found.answer.findings)
    share, low, high = (float(known[f"yield_all{end}"]) for end in ("", "_low", "_high"))
    checked = found.answer.checked
    if any_other:
        return
    if high < target:
        yield finding_for("yield.short", "yield", share=share, target=target)
    elif share < target:
        yield finding_for("yield.uncertain", "yield", share=share, target=target, low=low, high=high)
    elif checked:
        code = "yield.by_estimate" if checked.low < target else "yield.spare"
        yield finding_for(code, "yield", **checked._asdict(), target=target)


def _alone(found: Allocated) -> Iterator[Finding]:
    """Measures that with all that is bought at its narrowest still use up most of the permitted failures."""
    permitted, effects = 1 - found.asked.target, found.rows.effects
    if any(one.code == "yield.not_normal" for one in found.answer.findings):
        return
    for label, fails in found.answer.alone.items():
        if not fails > MOST * permitted:
            continue
        rows = np.flatnonzero(np.array(effects.labels) == label)
        spread = np.max(np.abs(effects.sigma()[rows] * found.answer.tolerances), axis=0)
        fixed = [one.fixed for one in found.answer.problem.contributions]
        largest = int(np.argmax(np.where(fixed, spread, 0.0)))
        name = found.answer.problem.contributions[largest].name if np.any(spread[fixed] > 0) else None
        yield finding_for("yield.alone", label, fails=fails, permitted=permitted, largest=name)


def _promised(known: xr.Dataset) -> Iterator[Finding]:
    """Measures of whose samples fewer keep the limits than three deviations of a normal one would.

    That is what RSS means where the tolerances are three deviations of theirs; other distributions, means off the
    middle, and correlations make it another.
    """
    for name, share, high in zip(
        *(known[key].values.tolist() for key in ("measure", "yield", "yield_high")), strict=True
    ):
        if not high < DEFAULT_YIELD:
            continue
        severity = Severity.ERROR if 1 - high > TWICE * (1 - DEFAULT_YIELD) else Severity.WARNING
        yield finding_for("yield.below_rss", f"measures.{name}", severity=severity, share=share, target=DEFAULT_YIELD)


def contradicted(found: Allocated, known: xr.Dataset) -> dict[str, str]:
    """Measures that first order does not describe within the tolerances found, with what it has and what they have.

    Of a worst case by its search, of other criteria by the standard deviation of samples.
    """
    told: dict[str, str] = {}
    for k, of in enumerate(found.study.linear.measures if found.answer.found else ()):
        if found.asked.criterion == "worst-case":
            lower, upper = limits(of)
            ends = [
                (known[f"{key}_lower"].values[k], known[f"{key}_upper"].values[k]) for key in ("searched", "worst_case")
            ]
            real, linear = (max(share_of(float(low), lower), share_of(float(high), upper)) for low, high in ends)
            what = f"the worst case found is {100 * real:.0f} % of the limit, to first order {100 * linear:.0f} %"
        elif "deviation" in known and found.asked.samples >= ENOUGH and not by_position(of.reference):
            real, linear = (float(known[key].values[k]) for key in ("deviation", "deviation_linear"))
            what = (
                f"the samples scatter {real / linear if linear > 0 else np.inf:.3g} times as much as first order says"
            )
        else:
            continue
        if max(real, linear) > 0 and not OTHERWISE * min(real, linear) > max(real, linear):
            told[of.measure.name] = what
    return told


def _searched(found: Allocated, known: xr.Dataset, otherwise: Mapping[str, str]) -> Iterator[Finding]:
    """Measures whose worst case, as found on the mechanism, is beyond a limit that first order keeps."""
    units = units_along(known["nominal"], "measure")
    for k, of in enumerate(found.study.linear.measures):
        lower, upper = limits(of)
        low, high = float(known["searched_lower"][k]), float(known["searched_upper"][k])
        shares = share_of(low, lower), share_of(high, upper)
        beyond = max(shares) - 1
        if not beyond > CLOSE or of.measure.name in otherwise:
            continue
        factor, unit = SHOWN.get(units[k], (1.0, units[k]))
        value, limit = (high, upper) if shares[1] >= shares[0] else (low, lower)
        severity = Severity.ERROR if beyond > ROUGH else Severity.WARNING if beyond > SLIGHT else Severity.NOTE
        yield finding_for(
            "allocation.worst_case_beyond", f"measures.{of.measure.name}", severity=severity, worst=factor * value,
            unit=unit, percent=100 * beyond, limit=factor * limit, accepted=100 * ROUGH,
        )  # fmt: skip
