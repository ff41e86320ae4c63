"""What findings about results say: their codes, with the sentence that is made of the figures of each."""

from trunnion.results.sentences.told import told

__all__ = ["told"]
