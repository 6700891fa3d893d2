"""Upper bounds of the worst cells with this connectivity and these held nodes."""
