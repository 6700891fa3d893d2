"""Ranges of work on threads, and how much memory there is."""
