"""Tables of what a model file may name: measures, distributions, costs, laws, pairs, modules, units."""

from __future__ import annotations

import inspect

from page_tables.cells import code, rows_of, unit


def measures_table() -> str:
    """Every kind of measure."""
    from trunnion.model.measure_table import MEASURES

    figures = {
        "deviation": "largest deviation from nominal",
        "line": "width about its least-squares line",
        "ratio": "over the cycle; of `instant` the largest deviation",
        "dead centre": "place where the joint turns back",
        "work": "over the cycle or range",
    }  # fmt: skip
    rows = [
        (
            code(name),
            " or ".join(quantity.unit for quantity in one.quantities),
            "places" if one.needs == "places" else "motion and forces" if one.of_forces else "motion",
            figures.get(one.rule, one.rule),
            one.long_name,
        )
        for name, one in MEASURES.items()
    ]
    return rows_of(("subject", "unit", "needs", "figure if nothing is stated", "what"), rows)


def distributions_table() -> str:
    """Every distribution of a deviation."""
    from trunnion.statistics.distributions import DISTRIBUTIONS

    def option(name: str, default: float | None) -> str:
        return code(name) if default is None else f"{code(name)} ({default:g})"

    rows = [
        (
            code(name),
            ", ".join(option(*pair) for pair in one.parameters.items()),
            "yes" if one.bounded else "no",
            one.long_name,
        )
        for name, one in DISTRIBUTIONS.items()
    ]
    return rows_of(("`distribution`", "takes (default)", "within its limits", "what"), rows)


def costs_table() -> str:
    """Every model of what a tolerance costs."""
    from trunnion.statistics.costs import COST_MODELS

    rows = [
        (
            code(name),
            code(model.formula),
            ", ".join(f"{code(key)}: {meaning}" for key, meaning in model.parameters.items()),
            model.source,
        )
        for name, model in COST_MODELS.items()
    ]
    return rows_of(("`model`", "cost of the half width t", "parameters", "source"), rows)


def laws_table() -> str:
    """Every friction law with its parameters."""
    from trunnion.joints.friction import FRICTION_LAWS

    parts = []
    for name, law in FRICTION_LAWS.items():
        rows = [
            (
                code(key),
                unit(one.unit) or "1",
                "none" if one.optional else "must be given" if one.default is None else f"{one.default:g}",
                f"{one.minimum:g} … {one.maximum:g}".replace("inf", "∞"),
                one.meaning,
            )
            for key, one in law.parameters.items()
        ]
        head = (
            f"**`{name}`** — {law.validity}. Source: {law.source}. Function: `joints.friction.{law.function.__name__}`."
        )
        parts.append(head + "\n\n" + rows_of(("parameter", "unit", "default", "range", "meaning"), rows))
    return "\n".join(parts)


def motion_table() -> str:
    """Every motion law of a driver."""
    from trunnion.joints.motion import MOTION_LAWS

    rows = [
        (
            code(name),
            ", ".join(code(key) for key in law.needs),
            ", ".join(code(key) for key in law.takes),
            f"{law.peak_rate:.4f}, {law.peak_second:.4f}" if law.profile else "",
            law.validity,
            law.source,
        )
        for name, law in MOTION_LAWS.items()
    ]
    head = ("`law`", "needs", "takes", "peak of s′, s″", "validity", "source")
    return rows_of(head, rows)


def motors_table() -> str:
    """Every kind of motor."""
    from trunnion.joints.motors import MOTORS

    rows = [
        (
            code(name),
            ", ".join(code(key) for key in kind.needs),
            ", ".join(code(key) for key in kind.takes),
            kind.validity,
            kind.source,
        )
        for name, kind in MOTORS.items()
    ]
    return rows_of(("`kind`", "needs", "takes", "validity", "source"), rows)


def contact_laws_table() -> str:
    """Every contact law, with what it returns of a stated restitution."""
    from trunnion.joints.contact import CONTACT_LAWS, restitution_of

    rows = []
    for name, law in CONTACT_LAWS.items():
        returned = (restitution_of(law.factor(stated)) for stated in (0.9, 0.5, 0.2))
        rows.append((code(name), *(f"{one:.4f}" for one in returned), law.validity, law.source))
    return rows_of(("`law`", "returns of 0.9", "of 0.5", "of 0.2", "validity", "source"), rows)


def pairs_table() -> str:
    """Every pair of the model file: where it exists and what it needs."""
    from trunnion.joints.clearance import CLEARANCE_MODELS
    from trunnion.joints.pairs import PAIRS
    from trunnion.model.joint_parts import Joint, contact_lacks

    where = {("planar", "spatial"): "always", ("spatial",): "in space", (): "no"}
    rows = []
    for name, one in PAIRS.items():
        part = "pin" if one.turns else "guide" if one.guided else ""
        lacks = contact_lacks(Joint(type=name, links=("first", "second")), spatial=True) if part else ()
        rubs = ", ".join(code(f"{part}.{size}") for size in lacks) if part else "" if not one.count else "not modelled"
        moves = MOVES.get(name) or " and ".join(one.motions)
        driven = one.motions[0] if one.one_axis else "no"
        plane = "yes" if one.planar else "no"
        play = {("planar", "spatial"): "yes", ("spatial",): "in space", (): "no"}[
            tuple(space for space, models in CLEARANCE_MODELS.items() if name in models)
        ]
        rows.append((code(name), one.symbol, one.count, moves, plane, where[one.needs_axis], driven, rubs, play))
    head = ("`type`", "letter", "freedoms", "motion", "in the plane", "needs an `axis`", "driven", "friction needs",
            "play")  # fmt: skip
    return rows_of(head, rows)


MOVES = {
    "helical": "rotation, and with it the slide by its `pitch`",
    "spherical": "any rotation",
    "universal": "rotation about a pin in each link, at right angles",
    "planar": "two slides across its axis, rotation about it",
    "fixed": "none",
}


def groups_table() -> str:
    """Every module with a closed form, and what solves the others."""
    from trunnion.groups import GROUPS, cylindrical_dyad

    rows = []
    for name, group in GROUPS.items():
        home = type(group).__module__
        about = inspect.getdoc(inspect.getmodule(type(group))) or ""
        rows.append((code(name), code(home.removeprefix("trunnion.")), about.splitlines()[0]))
    about = inspect.getdoc(cylindrical_dyad) or ""
    rows.append(("`CCC`, in space", "`groups.cylindrical_dyad`", about.splitlines()[0]))
    rows.append(("every other", "`groups.general`", "Any planar group, by Newton's method; drivers too"))
    rows.append(("every other, in space", "`groups.spatial`", "Any spatial group, likewise; drivers too"))
    return rows_of(("module", "where", "what"), rows)


def units_table() -> str:
    """Every kind of quantity."""
    from trunnion.model.units import KINDS

    return rows_of(
        ("kind", "a plain number is in", "for example"),
        [(kind.name, unit(kind.unit), code(kind.example)) for kind in KINDS.values()],
    )
