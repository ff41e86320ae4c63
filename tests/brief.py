"""What `trunnion.analyse` returns of positions alone, as means over the cycle ask for most; and whether it is right."""

from typing import Any

import numpy as np
from benchmarks.judged import planar, spatial
from benchmarks.judged.verdict import CHECKS, Results

from reference.maximal_space import unrolled
from reference.space_oracle import merged
from trunnion import FrictionMethod, Mechanism
from trunnion.cycle.positions import ALL, positions
from trunnion.cycle.summary import member_units
from trunnion.results import variables
from trunnion.results.dataset import driven
from trunnion.solve.run import prepare


@np.errstate(all="ignore")
def brief(mechanism: Mechanism, steps: int, method: FrictionMethod | None = None, refuse: bool = True) -> Any:
    """The variables of every position as `analyse` has them; NaN for what is a mean over the cycle.

    Without findings and summary: where a position locks, those are read of the whole cycle, which takes far longer.

    refuse: whether what statics does not determine is an error.
    """
    run = prepare(mechanism)
    if refuse and run.determinacy is not None:
        run.determinacy.refuse()
    at = positions(run, steps, method, averaged=False)
    along, units = driven(at.time, *at.dial), member_units(run.system)
    return variables.dataset(at.arrays, at.labels, along, at.means, {}, units, at.ideal, None, ALL.dtype, {})


def judged(data: dict[str, Any], result: Any) -> None:
    """Every solved position of a result keeps every limit of the judge, who has its published numbers and the model's.

    Motion by closure and drivers, balance of every link, friction by its law, tooth forces, power.
    """
    plain, judge = unrolled(data), spatial.judge if data.get("space") == "spatial" else planar.judge
    joints = {name: merged(plain, name) for name in plain["joints"]}
    for joint in joints.values():
        joint["friction"] = joint["friction"] if joint["friction"].get("coefficient") != 0.0 else None
    verdict = judge({**plain, "joints": joints}, Results(result))
    for check, limit in CHECKS.items():
        assert verdict.worst(check)[0] <= limit, verdict.worst(check)
