"""Compiled functions on plain arrays. They import nothing of the package."""
