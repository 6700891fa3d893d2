"""Numbers as text: compiled parsing and printing, both exact."""
