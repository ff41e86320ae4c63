"""What findings about results say: their codes, with the sentence that is made of the figures of each."""

from trunnion.results.sentences.codes import QUIET, finding_for

__all__ = ["QUIET", "finding_for"]
