"""What follows from connectivity: rings, winding, colours, memory order."""
