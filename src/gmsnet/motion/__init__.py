"""Boundaries that move: where their nodes are to go, by which way, and how the nodes inside follow."""
