"""The compiled part of each smoother, one method a file."""
