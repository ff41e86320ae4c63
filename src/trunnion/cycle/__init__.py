"""A cycle of a mechanism as a result: positions, means, summary, findings, locking, what errors do."""
