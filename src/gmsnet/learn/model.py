"""GMSNet: where a free node should go, seen from the node and its neighbours (the star polygon).

Wang, Chen, Yan, Liu: "Proposing an intelligent mesh smoothing method with graph neural networks" (arXiv 2311.12815);
equations by their place in the paper. B stars of n neighbours each (n differs from star to star), H hidden features,
N = Σ(n + 1) nodes in all.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gmsnet.errors import InputError
from gmsnet.learn.backend import Data, GCNConv, GraphNorm, torch
from gmsnet.learn.data import Stars


class GMSNet(torch.nn.Module):
    """The network, with 2H² + 10H + 2 parameters.

    Each star is a wheel: the free node is joined to its neighbours, and these to each other around the ring.
    """

    linear: torch.nn.Linear
    norm: Any
    gcn: Any
    mlp: torch.nn.ModuleList

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.hidden = hidden
        self.linear = torch.nn.Linear(2, hidden)
        self.norm = GraphNorm(hidden, eps=1e-5)
        self.gcn = GCNConv(hidden, hidden, add_self_loops=True, normalize=True, bias=True)
        self.mlp = torch.nn.ModuleList([torch.nn.Linear(hidden, hidden), torch.nn.Linear(hidden, 2)])

    def forward(self, stars: Data) -> torch.Tensor:
        """(B × 2) the shift of each free node in units of its star's size d: x* = x + d·shift. See ``wheels``."""
        # (4)  X_h = Norm(X) W_l + b_l,   Norm(x) = (x − x_0)/d,  d = max(Δx, Δy) of the star's n + 1 nodes
        features = self.linear(stars.x)  # (N × 2) → (N × H)

        # (5)  X̂_h = GraphNorm(X_h) = γ (x − αμ)/√(mean((x − αμ)²) + ε) + β,  means over the star's n + 1 nodes
        normed = self.norm(features, stars.batch, len(stars.centre))  # (N × H)

        # (6)  X_g = GCN(ReLU(X̂_h), Ã) + X̂_h
        # (7)      = Ã ReLU(X̂_h) W_g + b_g + X̂_h
        #      Ã = D̂^(−½) (A + I) D̂^(−½): 1/(n + 1) on the free node, 1/(2 √(n + 1)) on a spoke
        hidden = self.gcn(torch.relu(normed), stars.edge_index) + normed  # (N × H)

        return self.decode(hidden[stars.centre])  # (8)

    def decode(self, hidden: torch.Tensor) -> torch.Tensor:
        """(B × 2) the shift from the free node's features X_g[i_c, :] (B × H)."""
        # (8)  x* = MLP(X_g[i_c, :]),   MLP = Linear, InstanceNorm over the H features of each star, ReLU, Linear
        inner = self.mlp[0](hidden)  # (B × H)
        inner = torch.nn.functional.instance_norm(inner[:, None, :], eps=1e-5)[:, 0, :]
        shift: torch.Tensor = self.mlp[1](torch.relu(inner))  # (B × 2)
        return shift

    def propose(self, stars: Stars) -> NDArray[np.float64]:
        """(B × 2) the shift of each free node in the units of its mesh."""
        dtype = self.linear.weight.dtype
        ring = torch.as_tensor(stars.ring, dtype=dtype)
        with torch.no_grad():
            shift = self(wheels(ring, torch.as_tensor(stars.degree)))
        return np.asarray(shift.double().numpy() * stars.size[:, None])

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The parameters under the names of the weights file."""
        state = {_file_name(name): value for name, value in self.state_dict().items()}
        return {name: value.detach().to(torch.float32).numpy().copy() for name, value in state.items()}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, NDArray[np.float32]]) -> GMSNet:
        """The network with these parameters (names of the weights file)."""
        net = cls(len(tensors["linear.bias"]))
        net.load_state_dict({name: torch.tensor(tensors[_file_name(name)]) for name in net.state_dict()})
        return net


def _file_name(name: str) -> str:
    """The name in the weights file of a parameter: PyTorch Geometric hides the matrix of a layer one level deeper."""
    return "gcn.weight" if name == "gcn.lin.weight" else name


def wheels(ring: torch.Tensor, degree: torch.Tensor) -> Data:
    """The graph of B stars: ring (B × M × 2), scaled and relative to the free node; degree (B,).

    Returns x (N × 2), the free node of each star before its neighbours; edge_index (2 × 4Σn), spokes and rim in both
    directions; batch (N,) the star of each node; centre (B,) the free nodes.

    Raises InputError for a degree below 3, where the rim is no ring.
    """
    if len(degree) and int(degree.min()) < 3:
        raise InputError(f"a star needs at least 3 neighbours, got {int(degree.min())}")
    star = torch.repeat_interleave(torch.arange(len(degree)), degree)  # (Σn,) of each neighbour
    place = torch.arange(len(star)) - (torch.cumsum(degree, 0) - degree)[star]  # in its ring
    centre = torch.cumsum(degree + 1, 0) - (degree + 1)
    hub = centre[star]
    node = hub + 1 + place
    following = hub + 1 + (place + 1) % degree[star]
    x = ring.new_zeros(len(star) + len(degree), 2)
    x[node] = ring[star, place]
    edges = torch.stack([torch.cat([hub, node, node, following]), torch.cat([node, hub, following, node])])
    batch = torch.repeat_interleave(torch.arange(len(degree)), degree + 1)
    return Data(x=x, edge_index=edges, batch=batch, centre=centre)
