"""Sentences about studies: play, sweep, assembly, tolerances, allocation."""

from __future__ import annotations

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["STUDIES"]

RELY = "use the samples"
NOT_STEADY = "within {duration:~s} {driver} does not come to run steadily, or its motion ends before"
LONGER = "state a longer duration of the measure in the model; `trunnion simulate` with these values shows the motion"
MAGNITUDES = "check the orders of magnitude of costs and bounds"
WIDER = "allow narrower tolerances, widen a limit or ask for a lower yield"


def _curve(points: int, lost: int, least: float | None) -> str:
    return f"limits of at least {least:.3g} times the stated ones are feasible" if least is not None else ""


PLAY = {
    "play.measures_left_out": Sentence(
        NOTE,
        "left out: {measures}, which have no one value at every position",
        "use `trunnion tolerance` for other measures",
    ),
    "measure.none_stated": Sentence(
        NOTE,
        "the model states no measure; {measures} are used (joints to the ground without a driver)",
        "state measures: in the model, or use --measure link.point.x",
    ),
    "play.redundant": Sentence(
        WARNING,
        "constraints are redundant: the worst case is an upper bound, because pins constrain one another",
        "the deviation assumes that each pin can be anywhere within its play",
    ),
    "play.seats_not_taken": Sentence(
        NOTE,
        "play is relative to the middle of the holes: the worst case is over all positions of the pins and does not "
        "use the seats of {joints}",
        "`trunnion analyse` has the deviation with these seats",
    ),
    "play.mean_of_fits": Sentence(
        NOTE,
        "the play of {joints} is the mean of their fits; the largest is {largest:~m}, of {most}",
        "--set fits=maximum takes the largest play",
    ),
    "play.beyond_first_order": Sentence(
        NOTE,
        "to first order it changes by ±{first:~{unit}} at {at}; the worst found on the mechanism itself is "
        "{low:~{unit}} and {high:~{unit}}",
        "use these figures",
    ),
    "play.no_effect": Sentence(
        NOTE,
        "the play of {joints} has no effect on {measure}{at}",
        lambda drivers, moves, **_: (
            f"drive the joint that the machine drives, now {', '.join(drivers)}" if moves else ""
        ),
    ),
    "play.left_out": Sentence(
        WARNING, "the play of {joints} is left out ({kinds} joints)", "play is modelled in {modelled} joints"
    ),
    "play.gears": Sentence(
        WARNING,
        "gears turn in {joints}: the effect of this play on the tooth contact is left out",
        "an offset e of a gear's centre across the line of centres turns the gear by e over its pitch radius",
    ),
    "play.spin": Sentence(
        WARNING,
        "'{link}' can spin about the line {points[0]}-{points[1]}; this study sets that spin to zero",
        "measure one of these two points",
    ),
    "play.no_answer": Sentence(ERROR, "{status} {at}", "the effect of play is undefined there"),
    "limit.exceeded": Sentence(
        ERROR,
        "the worst case to first order, {worst:~{unit}} at {at}, exceeds the limit of {limit:~{unit}}",
        "reduce the play of the joints with the largest share",
    ),
    "limit.kept": Sentence(
        NOTE, "the worst case to first order, {worst:~{unit}} at {at}, is within the limit of {limit:~{unit}}"
    ),
}

SWEEP = {
    "sweep.no_answer": Sentence(
        ERROR,
        "{points:,} of {of:#point} {points:#has/have} no result, the first at {at} ({positions:#position} not solved): "
        "{status}",
        "run `trunnion analyse` with these values to see where in the cycle, and why",
    ),
    "sweep.no_efficiency": Sentence(
        NOTE,
        "the efficiency is undefined at {points:,} of {of:#point}, the first at {at}: {why}",
        "see the mean powers there; `trunnion analyse` with these values tells where loads act",
    ),
    "sweep.not_steady": Sentence(
        WARNING, f"{{measure}} has no value at {{points:,}} of {{of:#point}}, the first at {{at}}: {NOT_STEADY}", LONGER
    ),
    "sweep.measures_left_out": Sentence(
        NOTE,
        lambda measures: (
            f"the model's measure{'s' * (len(measures) > 1)} {', '.join(measures)} "
            f"{'are' if len(measures) > 1 else 'is'} not in this sweep"
        ),
        lambda measures: f"add {'them' if len(measures) > 1 else 'it'} with --measure, in Python with measures=[…]",
    ),
}

ASSEMBLY = {
    "assembly.apart": Sentence(ERROR, "{status} {at}", "check the lengths, or limit the range of the driver"),
    "assembly.clearance_short": Sentence(
        ERROR, "the stated clearances are too small to close the loops {takes}", "{remedy}"
    ),
    "assembly.no_play": Sentence(ERROR, "{none} stay open by up to {by}", "{remedy}"),
    "assembly.unsettled": Sentence(
        ERROR,
        "{status} {at}",
        "pins on a common axis block each other along it: give one an end float, or make it cylindrical",
    ),
    "assembly.no_need": Sentence(NOTE, "{why}: errors only shift its links, so it needs no clearance"),
    "assembly.fits": Sentence(NOTE, "the loops close without any clearance"),
    "assembly.clearance_enough": Sentence(
        NOTE, "the stated clearances are sufficient: {told} times their size is needed, {at}"
    ),
}

TOLERANCE = {
    "limit.missed": Sentence(ERROR, "limits not met: {told}; {limits}", "{remedy}"),
    "limit.missed_yield": Sentence(
        ERROR, "limits not met: {told}, required {target_percent:.6g} %; {limits}", "{remedy}"
    ),
    "limit.missed_together": Sentence(
        ERROR,
        "limits not met: yield of all measures together {percent:.6g} % (95 % confidence interval {percent_low:.5g} to "
        "{percent_high:.5g} %), required {target_percent:.6g} %",
        "narrow the tolerances of the measure with the lowest yield first",
    ),
    "tolerance.seats_not_taken": Sentence(
        NOTE,
        "the pins of {joints} can be anywhere in their holes here: that the model has them pressed by the load (seat: "
        "loaded) is left out, and scatter and limits are about the mechanism with every pin in the middle of its hole",
        "`trunnion analyse` has the shift by that seat; pins that are always pressed one way: state seat: {{xi: …}}",
    ),
    "tolerance.correlations_left_out": Sentence(
        NOTE,
        "RSS and worst case ignore the correlations; standard deviation, shares of variance and samples include them",
    ),
    "tolerance.shared_dimension": Sentence(
        NOTE,
        "one tolerance sets points of {links} ({shown}): these links deviate together, by the same amount",
        "if the links are made separately, give each a dimension of its own with its own tolerance",
    ),
    "tolerance.indices_lost": Sentence(
        WARNING,
        "{count:#sample} of the variance-based indices {count:#was/were} not solved and {count:#counts/count} as the "
        "mean",
        "narrow the tolerances, or take the measure at a position that all samples reach",
    ),
    "tolerance.measured_outside": Sentence(
        WARNING,
        "{count:,} of {of:,} measured deviations are outside the tolerance {lower:g} to {upper:g}, the largest is "
        "{farthest:g} (SI units)",
        "check the unit of the data",
    ),
    "tolerance.negative": Sentence(
        WARNING, "its tolerance includes negative values, down to {least:~{unit}}", "narrow the tolerance"
    ),
    "tolerance.range_fixed": Sentence(
        WARNING,
        "the tolerance of {numbers} does not move the range of {driver} in the samples, which are all at the same "
        "places of the drive",
        "state the deviation in the link that it moves, as a dimension e in its points, such as [r*cos(e), r*sin(e)]; "
        "`trunnion sweep` moves the range",
    ),
    "tolerance.impossible": Sentence(
        WARNING, "its tolerance includes {value:~{unit}}, which no model may have: {why}", "narrow the tolerance"
    ),
    "tolerance.nominal_no_answer": Sentence(ERROR, "nominal mechanism: {status} {at}", "there is no result there"),
    "tolerance.near_singular": Sentence(
        WARNING, "close to a dead centre {at}: the first-order result is not reliable there", "use the samples there"
    ),
    "tolerance.nominal_no_figure": Sentence(
        ERROR,
        "{measure}: undefined for the nominal mechanism",
        "take it at a position, or over a range, where it is defined",
    ),
    "tolerance.nominal_not_steady": Sentence(
        ERROR, f"{{measure}}: undefined for the nominal mechanism: {NOT_STEADY}", LONGER
    ),
    "first_order.one_sided": Sentence(
        WARNING, "a joint is momentarily at rest there: friction jumps, and the first-order result is one-sided", RELY
    ),
    "first_order.no_answer": Sentence(WARNING, "the first-order analysis has no result", RELY),
    "first_order.corner_open": Sentence(
        WARNING,
        "the mechanism cannot be solved at the tolerance limits that give the {end} deviation to first order",
        "within these tolerances it cannot always be assembled",
    ),
    "first_order.corner_not_steady": Sentence(
        WARNING, f"at the tolerance limits that give the {{end}} deviation to first order, {NOT_STEADY}", LONGER
    ),
    "first_order.worst_case_differs": Sentence(
        NOTE,
        "the worst case found by search is {ratio:.2f} times the first-order one",
        "use the one found by search, and the samples",
    ),
    "first_order.scatter_differs": Sentence(
        WARNING,
        "the standard deviation of the samples is {found:~{unit}}, the first-order one {linear:~{unit}}",
        "first order and its contributions do not describe this measure: use the samples, and --method sobol for the "
        "contributions",
    ),
    "samples.no_answer": Sentence(
        ERROR,
        "{count:,} of {samples:#sample} ({share:.2%}) could not be solved: {why}",
        "they count as outside every limit; mean and standard deviation are of the others",
    ),
    "samples.engine": Sentence(NOTE, "the samples are computed by the engine {engine}", quiet=True),
}

ALLOCATION = {
    "allocation.proven_roughly": Sentence(
        WARNING, "the optimality gap is {gap:.1e} of the cost of the tolerances", MAGNITUDES
    ),
    "allocation.not_found": Sentence(
        ERROR, "the solver found no allocation, although the limits may be feasible", MAGNITUDES
    ),
    "allocation.unbounded": Sentence(ERROR, "no limit bounds this tolerance, and wider is cheaper", "state `most`"),
    "allocation.impossible": Sentence(
        ERROR,
        "the limit {limit_told} is infeasible: with all tolerances at their least the deviation is "
        "{takes_told}{normal}{ratio}{more}",
        "widen the limit, or first {narrow} has the largest share",
    ),
    "allocation.nominal_outside": Sentence(
        ERROR,
        "the nominal value is {told}, {word} is {limit}: tolerances cannot correct that",
        "change the mechanism or the bound",
    ),
    "allocation.unknown": Sentence(
        WARNING,
        "the measure has no first-order result: its limits were ignored in the allocation",
        "check with the samples whether they are met",
    ),
    "allocation.not_for_sale": Sentence(
        WARNING, "this tolerance is not allocated: {why}", "remove the cost; the tolerance stays as stated"
    ),
    "allocation.play_tolerance": Sentence(
        NOTE,
        "the clearance is allocated; the tolerance {lower_um:+g}/{upper_um:+g} µm of {number} stays as stated, in "
        "addition to it, and the limits include it",
        "remove this tolerance if the cost covers the largest clearance",
    ),
    "allocation.unsettled": Sentence(
        WARNING,
        "the effects depend on the tolerances themselves and did not converge in {rounds} iterations",
        "use the verification",
    ),
    "allocation.narrowed": Sentence(
        NOTE, "its limits were narrowed by {percent:.2g} % so that the mechanism meets them exactly, not to first order"
    ),
    "allocation.correlations_left_out": Sentence(
        WARNING, "the criterion {criterion} ignores the correlations", "use a yield, which includes them"
    ),
    "allocation.curve_short": Sentence(
        NOTE, "{lost} of the {points} points of the curve {lost:#is/are} infeasible", _curve
    ),
    "allocation.worst_case_beyond": Sentence(
        WARNING,
        "the worst case of the mechanism, {worst:~{unit}}, exceeds the limit {limit:~{unit}} by {percent:.2g} %; to "
        "first order it is met (up to {accepted:g} % beyond is accepted)",
        "use --exact (in Python exact=True), which narrows the tolerances",
    ),
    "yield.missed": Sentence(
        ERROR,
        lambda share, low, high, target: (
            f"the yield found is {share:.6g}{f' (95 % interval {low:.6g} to {high:.6g})' if low < high else ''}, "
            f"the required one {target:g}"
        ),
        lambda high, target, **_: (
            WIDER
            if high < target
            else "take more samples; --sure (in Python sure=True) asks the lower end of the interval to meet it"
        ),
    ),
    "yield.below_rss": Sentence(
        WARNING,
        "the yield of the samples is {share:.6g}; an RSS within the limits implies {target:g}",
        "require that yield instead, which uses distributions, means and correlations as stated",
    ),
}

STUDIES: dict[str, Sentence] = {**PLAY, **SWEEP, **ASSEMBLY, **TOLERANCE, **ALLOCATION}
