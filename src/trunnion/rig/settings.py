"""What the conditions of a measurement set, beside what these numbers are in the model."""

from __future__ import annotations

from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.parameters import measured
from trunnion.model.units import Kind, dimension_text
from trunnion.rig.reading.measurement import Measurement

__all__ = ["check_settings"]


def check_settings(mechanism: Mechanism, measurement: Measurement) -> None:
    """MechanismError where a condition states a number in a unit that the model's number cannot have.

    Names that the model does not have, and numbers without a unit, which are SI, are passed over.
    """
    findings: dict[tuple[str, str], Finding] = {}
    stated = {name for one in measurement.conditions for name in one.dimensions}
    kinds: dict[str, Kind | None] = {}
    for name in stated:
        try:
            path = mechanism.path_of(name)
        except MechanismError:  # told with the condition it is in
            continue
        entries = mechanism.parameter_set.entries
        if path not in entries:  # a number that the model does not state yet
            value = next(one.values[name] for one in measurement.conditions if name in one.dimensions)
            try:
                other = mechanism.with_values({name: value})
            except MechanismError:
                continue
            kinds[name] = measured(other, other.parameter_set.entries.values()).get(path)
        else:
            kinds[name] = measured(mechanism, entries.values()).get(path)
    for condition in measurement.conditions:
        for name, dimension in condition.dimensions.items():
            kind = kinds.get(name)
            if kind is None or kind.accepts(dimension):
                continue
            what = f"{dimension_text(dimension)} is set where the model has {_needed(kind.name)}"
            remedy = f"set {_needed(kind.name)} such as {kind.example}, or another number of the model"
            file = str(condition.files[0]) if condition.files else ""
            told = f"{what} (in condition {condition.name})"
            findings.setdefault((name, what), Finding(told, f"set.{name}", remedy, file=file))
    if findings:
        raise MechanismError(list(findings.values()))


def _needed(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"
