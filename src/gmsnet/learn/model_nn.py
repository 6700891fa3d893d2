"""NN-Smoothing: for each degree a network that tells from the ring where its free node should be.

Guo, Wang, Ma et al.: "A new mesh smoothing method based on a neural network" (2021), as the paper of GMSNet uses it. B
stars of one degree n each; the widths h₁, h₂ stand in weights.shapes.NN_HIDDEN.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.weights.shapes import NN_HIDDEN


class RingNetwork(torch.nn.Module):
    """The network of one degree: 2n → h₁ → h₂ → 2 with sigmoids."""

    layers: torch.nn.ModuleList

    def __init__(self, degree: int) -> None:
        super().__init__()
        widths = (2 * degree, *NN_HIDDEN[degree], 2)
        self.layers = torch.nn.ModuleList([torch.nn.Linear(widths[k], widths[k + 1]) for k in range(3)])

    def forward(self, ring: torch.Tensor) -> torch.Tensor:
        """(B × 2) the place of each free node in the frame of its ring. ring: (B × n × 2) in that frame."""
        first = torch.sigmoid(self.layers[0](ring.flatten(1)))  # (B × h₁)
        second = torch.sigmoid(self.layers[1](first))  # (B × h₂)
        place: torch.Tensor = self.layers[2](second)
        return place


class NNSmoothing(torch.nn.ModuleDict):
    """The seven networks by "degree3" … "degree9", with 4,864 parameters in all."""

    def __init__(self) -> None:
        super().__init__({f"degree{degree}": RingNetwork(degree) for degree in NN_HIDDEN})

    def of_degree(self, degree: int) -> RingNetwork:
        """The network of a degree from 3 to 9."""
        net = self[f"degree{degree}"]
        assert isinstance(net, RingNetwork)
        return net

    def propose(self, stars: Stars) -> NDArray[np.float64]:
        """(B × 2) the shift of each free node in the units of its mesh; to the mean of the ring in other degrees."""
        shift = stars.ring.sum(axis=1) / stars.degree[:, None]
        for degree in NN_HIDDEN:
            chosen = stars.degree == degree
            if chosen.any():
                net = self.of_degree(degree)
                ring = torch.as_tensor(stars.ring[chosen, :degree], dtype=next(net.parameters()).dtype)
                low, size = frame(ring)
                with torch.no_grad():
                    shift[chosen] = (low + size * net((ring - low[:, None]) / size[:, None])).double().numpy()
        return np.asarray(shift * stars.size[:, None])

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The parameters under the names of the weights file."""
        state = {name.replace(".layers.", "."): value for name, value in self.state_dict().items()}
        return {name: value.detach().to(torch.float32).numpy().copy() for name, value in state.items()}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, NDArray[np.float32]]) -> NNSmoothing:
        """The networks with these parameters (names of the weights file)."""
        nets = cls()
        names = {name: name.replace(".layers.", ".") for name in nets.state_dict()}
        nets.load_state_dict({name: torch.tensor(tensors[there]) for name, there in names.items()})
        return nets


def frame(ring: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """The frame of rings (B × n × 2): the lower left corner (B × 2) and the longer side (B × 1) of the bounding box.

    The free node does not count: the networks do not see it.
    """
    low = ring.amin(dim=1)
    return low, (ring.amax(dim=1) - low).amax(dim=1, keepdim=True)
