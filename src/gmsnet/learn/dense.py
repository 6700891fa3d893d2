"""GMSNet on padded stars: the shifts of ``model.GMSNet`` from its own parameters, for training.

A graph of a few thousand stars has tens of thousands of nodes and edges, and an epoch would mostly gather along them.
On padded rings the same sums run over one axis. Only the free node's row of the graph convolution is
computed, as only that one is used. Shapes and equations as in ``model``; M is the largest degree.
"""

from __future__ import annotations

from gmsnet.learn.backend import torch
from gmsnet.learn.model import GMSNet


def shifts(net: GMSNet, ring: torch.Tensor, degree: torch.Tensor) -> torch.Tensor:
    """(B × 2) the shift of each free node. ring: (B × M × 2), scaled and relative to the free node; degree: (B,)."""
    inside = (torch.arange(ring.shape[1]) < degree[:, None]).to(ring.dtype)[:, :, None]
    count = (degree + 1).to(ring.dtype)[:, None]  # the free node counts

    # (4)  of the ring (B × M × H) and of the free node, the origin (H)
    features, centre = net.linear(ring), net.linear.bias

    # (5)
    mean = ((features * inside).sum(dim=1) + centre) / count  # (B × H)
    features, centre = features - (net.norm.mean_scale * mean)[:, None], centre - net.norm.mean_scale * mean
    moment = ((features.square() * inside).sum(dim=1) + centre.square()) / count
    scale = net.norm.weight / (moment + net.norm.eps).sqrt()
    features, centre = features * scale[:, None] + net.norm.bias, centre * scale + net.norm.bias

    # (6), (7)  Ã is 1/(n + 1) on the free node and 1/(2 √(n + 1)) on a spoke
    spokes = (torch.relu(features) * inside).sum(dim=1) / (2.0 * count.sqrt())
    hidden = net.gcn.lin(spokes + torch.relu(centre) / count) + net.gcn.bias + centre  # (B × H)

    return net.decode(hidden)  # (8)
