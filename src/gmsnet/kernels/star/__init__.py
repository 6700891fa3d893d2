"""A free node with the cells around it: blocks of stars, the guard, its certificates, truncation."""
