"""Every method with each of its variants and objectives."""

from __future__ import annotations

from gmsnet import METHODS


def name_of(method):
    return "-".join(method.values())


CHOICES = [
    {"method": name, **({"variant": variant} if variant else {}), **({"objective": objective} if objective else {})}
    for name, method in METHODS.items()
    for variant in method.variants or [""]
    for objective in method.objectives or [""]
]

# How the names of the methods begin whose result depends on how the mesh lies to the axes: the paper's networks scale a
# star by the sides of a bounding box and read plain coordinates; Adam scales each component of a gradient by itself.
TURN_MATTERS = ("gmsnet-", "nn", "optimize-adam")
