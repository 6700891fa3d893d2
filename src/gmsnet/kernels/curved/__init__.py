"""Second-order planar cells: nodes with what they drag along, guarded moves, descent on Bernstein coefficients."""
