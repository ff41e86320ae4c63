"""Results of `tolerance` of a four-bar whose rocker may be off by 0.1°: every kind that a view must bear."""

from functools import cache

import numpy as np
from as_built_models import EXAMPLES

import trunnion
from mechanisms_parts import joined

LIMIT = np.radians(0.1)
ODD = ["Ω—Welle", "</script><script>alert(1)</script>", '<img src=x onerror="alert(2)">', "_$x$ & <!-- 曲柄"]
ALL = ("linear", "worst-case", "monte-carlo")
ANGLE = {"angle": "rocker", "limit": "±0.1 deg"}


@cache
def _studied(positions, samples, half, methods, measures, more, crank, measure):
    data = trunnion.read(EXAMPLES / "toleranced-fourbar.yaml").data()
    del data["costs"]
    data["dimensions"] |= {"l2": crank, **{f"e{k}": "0 mm" for k in range(more)}}
    data["links"]["rocker"]["points"]["C"] = ["l4" + "".join(f" + {0.01 + 1e-4 * k} * e{k}" for k in range(more)), 0]
    data["tolerances"] = dict.fromkeys(["l1", "l2", "l3", "l4", *(f"e{k}" for k in range(more))], f"±{half}")
    names = ["angle-error", *(f"angle-error-{k}" for k in range(2, measures + 1))]
    data["measures"] = {name: dict(measure) for name in names}
    if "angle" not in data["measures"]["angle-error"]:
        data["tolerances"]["joint_defaults.friction.coefficient"] = "±0.02"
    return trunnion.tolerance(trunnion.Mechanism(**data), methods=methods, samples=samples, steps=positions, jobs=1)


def toleranced(
    positions=72, samples=1000, half="0.07 mm", methods=ALL, measures=1, more=0, crank="30 mm", measure=ANGLE
):
    """The study; more: numbers of little effect; measures: of the same."""
    key = tuple(measure.items())
    return _studied(positions, samples, half, tuple(methods), measures, more, crank, key).copy(deep=True)


def structure():
    """Without a driver: one position, no coordinate of a drive."""
    links = {"ground": {"A": [0, 0], "D": ["l1", 0]}, "coupler": {"A": [0, 0], "C": ["l3", 0]},
             "rocker": {"D": [0, 0], "C": ["l4", 0]}}  # fmt: skip
    truss = trunnion.Mechanism(
        dimensions={"l1": "100 mm", "l3": "90 mm", "l4": "70 mm"},
        links={name: {"points": points} for name, points in links.items()},
        joints=joined("ground -A- coupler -C- rocker, ground -D- rocker"),
        assembly={"C": ["60 mm", "60 mm"]},
        measures={"theta": ANGLE},
        tolerances=dict.fromkeys(("l1", "l3", "l4"), "±0.07 mm"),
    )  # fmt: skip
    return trunnion.tolerance(truss, samples=1000, jobs=1)


def odd_names():
    """Names that try to break out of a page or a plot."""
    result = toleranced().assign_coords(parameter=ODD, measure=["_$ω$ <b>曲柄</b>"])
    result.attrs["name"] = "</style><script>alert(3)</script>"
    return result


CASES = {
    "plain": toleranced,
    "one position": lambda: toleranced(measure={"angle": "rocker", "at": "60 deg", "limit": "+0.1/-0.05 deg"}),
    "structure": structure, "torque": lambda: toleranced(measure={"effort": "A", "as": "maximum"}),
    "no limits": lambda: toleranced(measure={"angle": "rocker"}), "failures": lambda: toleranced(crank="59.9 mm"),
    "linear only": lambda: toleranced(methods=("linear",)),
    "sobol": lambda: toleranced(methods=("linear", "quasi-monte-carlo", "sobol")),
    "all within": lambda: toleranced(half="0.02 mm"), "twelve measures": lambda: toleranced(24, 200, measures=12),
    "thirty parameters": lambda: toleranced(more=26), "odd names": odd_names, "gap": lambda: toleranced(crank="62 mm"),
}  # fmt: skip
