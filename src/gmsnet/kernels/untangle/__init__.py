"""Untangling: exact signs, patches and the barrier that moves nodes of inverted cells."""
