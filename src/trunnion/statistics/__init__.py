"""Random numbers, running sums and intervals: what a study of tolerances counts with. It knows no mechanism."""
