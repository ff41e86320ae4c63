"""Sentences about studies: play, sweep, assembly, tolerances, allocation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from trunnion.errors import counted
from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["STUDIES"]

RELY = "rely on the samples"
MAGNITUDES = "check the orders of magnitude of costs and bounds"
WIDER = "allow narrower tolerances, widen a limit or ask for less"


def _carried(ratios: Mapping[str, float], links: Mapping[str, Sequence[str]], joint: str) -> str:
    """ratios: of the deviation with the pin's place on its other link, by joint; links: of the joints."""
    told = ", ".join(f"'{links[name][0]}' in {name}: {ratio:.3g} times" for name, ratio in ratios.items())
    holes = ", ".join(f"'{links[name][1]}' in {name}" for name in ratios)
    what = f"scatter and yield suppose that pins keep their places on the links of the holes ({holes}); on the other "
    return f"{what}link the deviation is another ({told}); the worst case is of both"


def _curve(points: int, lost: int, least: float | None) -> str:
    return f"limits of at least {least:.3g} times the stated ones can be kept" if least is not None else ""


PLAY = {
    "play.measures_left_out": Sentence(
        NOTE,
        "play is known of measures {known} and effort, which {measures} is none of: left out",
        "`trunnion tolerance` knows the others",
    ),
    "measure.none_stated": Sentence(
        NOTE,
        "no measure is stated: {measures} taken, joints to the ground without a driver",
        "state measures: in the model, or give --measure link.point.x",
    ),
    "play.redundant": Sentence(
        WARNING,
        "constraints are redundant: the worst case is an upper bound, for pins that must fit one another",
        "the deviation supposes that each may lie anywhere",
    ),
    "play.seats_not_taken": Sentence(
        NOTE,
        "play is counted from the middle of the holes: the seats of {joints} are not taken",
        "analyse takes them",
    ),
    "play.left_out": Sentence(
        WARNING, "the play of {joints} is left out ({kinds})", "play is modelled in {modelled} joints"
    ),
    "play.gears": Sentence(
        WARNING,
        "gears turn in {joints}: what their play does between the teeth is left out",
        "a gear's centre off by e across the line of centres turns it by e over its pitch radius more",
    ),
    "play.spin": Sentence(
        WARNING,
        "'{link}' can spin about the line of {points[0]} and {points[1]}: it is taken not to, whatever the play",
        "measure one of these points",
    ),
    "play.no_answer": Sentence(ERROR, "{status} {at}", "no effect of play is known there"),
    "limit.exceeded": Sentence(
        ERROR,
        "the worst case is {worst:.4g} {unit} at {at}, the limit is {limit:.4g} {unit}; it is above {over}",
        "tighten the joints with the largest share",
    ),
    "limit.kept": Sentence(
        NOTE, "the worst case is {worst:.4g} {unit} at {at}, the limit is {limit:.4g} {unit}: it is kept"
    ),
}

SWEEP = {
    "sweep.no_answer": Sentence(
        ERROR,
        "{points:,} of {of:#point} {points:#has/have} no figures, first at {at} ({positions:#position} without an "
        "answer): {status}",
        "run analyse with these values: it says where in the cycle, and why",
    ),
    "sweep.measures_left_out": Sentence(
        NOTE,
        lambda measures: (
            f"the model's measure{'s' * (len(measures) > 1)} {', '.join(measures)} "
            f"{'are' if len(measures) > 1 else 'is'} not in this sweep"
        ),
        "name it by --measure, in Python by measures=[…]",
    ),
}

ASSEMBLY = {
    "assembly.apart": Sentence(ERROR, "{status} {at}", "check the lengths, or limit the range of the driver"),
    "assembly.clearance_short": Sentence(ERROR, "the stated clearances do not close the loops {takes}", "{remedy}"),
    "assembly.no_play": Sentence(ERROR, "{none} stay open by up to {by}", "{remedy}"),
    "assembly.unsettled": Sentence(
        ERROR,
        "{status} {at}",
        "pins that share an axis hold each other along it: give one an end float, or make it cylindrical",
    ),
    "assembly.no_need": Sentence(NOTE, "{why}: errors shift its links, and it needs no clearance"),
    "assembly.fits": Sentence(NOTE, "the axes fit: the loops close without any clearance"),
    "assembly.clearance_enough": Sentence(
        NOTE, "the stated clearances take up the errors: {told} of them is needed, {at}"
    ),
}

TOLERANCE = {
    "limit.missed": Sentence(ERROR, "limits not kept: {told}; {limits}", "{remedy}"),
    "limit.missed_yield": Sentence(
        ERROR, "limits not kept: {told}, {target_percent:.6g} % asked for; {limits}", "{remedy}"
    ),
    "limit.missed_together": Sentence(
        ERROR,
        "limits not kept: yield of all measures together {percent:.6g} % (95 % interval {percent_low:.5g} to "
        "{percent_high:.5g} %), {target_percent:.6g} % asked for",
        "narrower tolerances of the measure with the lowest yield first",
    ),
    "tolerance.seats_not_taken": Sentence(
        NOTE,
        "pins lie anywhere in their holes: seats by loads of {joints} are not taken",
        "analyse takes them",
    ),
    "tolerance.correlations_left_out": Sentence(
        NOTE,
        "RSS and worst case leave the correlations out: deviation, shares of variance and samples have them",
    ),
    "tolerance.indices_lost": Sentence(
        WARNING,
        "{count:#sample} of the variance-based indices {count:#has/have} no answer and {count:#counts/count} as the "
        "mean",
        "narrower tolerances, or a place where all go together",
    ),
    "tolerance.measured_outside": Sentence(
        WARNING,
        "{count:,} of {of:,} measured deviations are outside the limits {lower:g} to {upper:g}, the farthest "
        "{farthest:g} (SI)",
        "check their unit",
    ),
    "tolerance.negative": Sentence(
        WARNING, "its limits let it be {least:g} (SI), which is negative", "narrow the limits"
    ),
    "tolerance.nominal_no_answer": Sentence(ERROR, "nominal: {status} {at}", "nothing is known there"),
    "tolerance.near_singular": Sentence(
        WARNING, "close to a dead centre {at}: first order says little there", "rely on the samples there"
    ),
    "tolerance.nominal_no_figure": Sentence(
        ERROR,
        "{measure}: the nominal mechanism has no such figure",
        "take it at a place, or over a range, where there is one",
    ),
    "first_order.one_sided": Sentence(
        WARNING, "a relative speed is zero there: friction jumps, and first order is of one side", RELY
    ),
    "first_order.no_answer": Sentence(WARNING, "first order has no answer", RELY),
    "first_order.corner_open": Sentence(
        WARNING,
        "at the linear corner of the {end} deviation the mechanism has no answer",
        "the tolerances let it not go together there",
    ),
    "first_order.worst_case_differs": Sentence(
        NOTE,
        "the worst case found is {ratio:.2f} times that of first order",
        "rely on the one found, and on samples",
    ),
    "first_order.scatter_differs": Sentence(
        WARNING,
        "the samples scatter by {found:.4g} (SI), first order says {linear:.4g}",
        "it is not linear within the tolerances: rely on the samples",
    ),
    "play.carried": Sentence(
        NOTE,
        _carried,
        lambda ratios, links, joint: f"say joints.{joint}.seat_on: {links[joint][0]} or {links[joint][1]}",
    ),
    "samples.no_answer": Sentence(
        ERROR,
        "{count:,} of {samples:#sample} ({share:.2%}) {count:#has/have} no answer: {why}",
        "they count as outside every limit; moments are of the others",
    ),
    "samples.stopped": Sentence(
        WARNING,
        lambda kept, done, samples: f"stopped before the end: {done:,} of {counted(samples, 'sample')}",
        lambda kept, done, samples: "go on with --resume" if kept else "with --checkpoint FILE what is done is kept",
    ),
    "samples.machines": Sentence(
        NOTE,
        "machines of {kinds} kinds took part, whose sines or logarithms differ in the last bit",
        "as good an answer, but another mix may give other last bits; use machines of one kind",
    ),
}

ALLOCATION = {
    "allocation.proven": Sentence(
        NOTE, "no tolerances cost less, to first order: proven to {gap:.1e} of what they change"
    ),
    "allocation.proven_margin": Sentence(
        NOTE, "no tolerances with the same margin at every limit cost less, to first order"
    ),
    "allocation.proven_roughly": Sentence(
        WARNING, "the optimum is proven only to {gap:.1e} of what the tolerances cost", MAGNITUDES
    ),
    "allocation.choice_proven_roughly": Sentence(WARNING, "the optimum is proven only to {gap:.1e} of the cost"),
    "allocation.not_found": Sentence(
        ERROR, "the solver found no allocation, though nothing says that the limits cannot be kept", MAGNITUDES
    ),
    "allocation.no_choice": Sentence(
        ERROR, "no choice of processes keeps the limits", "widen a limit or add a finer process"
    ),
    "allocation.no_common_option": Sentence(
        ERROR, "no option of the group lies between the bounds of all", "widen them"
    ),
    "allocation.unbounded": Sentence(ERROR, "no limit bounds this tolerance: the wider, the cheaper", "state `most`"),
    "allocation.impossible": Sentence(
        ERROR,
        "no tolerances keep the limit {limit_told}: with all at their least it takes {takes_told}{ratio}{more}",
        "widen the limit, or narrow first '{largest}', {kept} and has the largest part",
    ),
    "allocation.nominal_outside": Sentence(
        ERROR,
        "the nominal figure is {told}, {word} is {limit}: no tolerance mends that",
        "change the mechanism or the bound",
    ),
    "allocation.unknown": Sentence(
        WARNING,
        "first order says nothing of it: no tolerances were chosen for its limits",
        "see whether the samples keep them",
    ),
    "allocation.not_for_sale": Sentence(
        WARNING, "cannot be bought, {why}", "remove the cost; the tolerance stays as it is"
    ),
    "allocation.unsettled": Sentence(
        WARNING,
        "what the tolerances do depends on themselves, and has not settled after {rounds} rounds",
        "rely on the verification",
    ),
    "allocation.narrowed": Sentence(
        NOTE, "its limits were taken {percent:.2g} % narrower, so that the mechanism itself keeps them"
    ),
    "allocation.correlations_left_out": Sentence(
        WARNING, "the criterion {criterion} leaves the correlations out", "ask for a yield, which has them"
    ),
    "allocation.curve_short": Sentence(
        NOTE, "{lost} of the {points} points of the curve {lost:#has/have} no tolerances that keep the limits", _curve
    ),
    "allocation.worst_case_beyond": Sentence(
        WARNING,
        "the worst case found on the mechanism is {worst:+.6g} {unit}, {percent:.2g} % beyond the limit {limit:+.6g} "
        "{unit} that first order keeps",
        "ask for `exact`, which takes them narrower",
    ),
    "yield.short": Sentence(
        ERROR,
        "the yield of the samples is {share:.6g}, {target:g} was asked for",
        "ask for more, or allow narrower tolerances",
    ),
    "yield.uncertain": Sentence(
        NOTE,
        "the yield of the samples is {share:.6g}, less than {target:g}, which lies in its interval {low:.6g} to "
        "{high:.6g}",
        "take more samples, or ask for more, to be surer",
    ),
    "yield.below_rss": Sentence(
        WARNING,
        "the yield of the samples is {share:.6g}, an RSS within the limits stands for {target:g}",
        "ask for that yield, which takes distributions, means and correlations as they are",
    ),
    "yield.narrowest": Sentence(
        ERROR, "with all tolerances as narrow as they can be the yield is {share:.6g}, not {target:g}", WIDER
    ),
    "yield.best": Sentence(ERROR, "the best yield that was sampled is {share:.6g}, not {target:g}", WIDER),
}

STUDIES: dict[str, Sentence] = {**PLAY, **SWEEP, **ASSEMBLY, **TOLERANCE, **ALLOCATION}
