"""Cells measured by a metric: a symmetric positive definite tensor at each place, by which lengths are 1."""
