"""Where nodes may go that are not free to go anywhere: the curves that boundary and interface nodes slide on."""
