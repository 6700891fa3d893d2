"""GMSNet 2 in PyTorch: messages per triangle, trained against a barrier through whole sweeps.

The formulas, and what each letter means, stand in kernels/methods/gmsnet2.py. B stars, M the largest degree, H hidden
features.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from gmsnet.learn.backend import torch
from gmsnet.learn.data import Stars
from gmsnet.weights import shapes

LEAST, CLIP, TINY = 1e-5, 40.0, 1e-30  # as in kernels.methods.gmsnet2
ACTIVATIONS: dict[str, Callable[..., torch.Tensor]] = {"silu": torch.nn.functional.silu, "relu": torch.relu}


class GMSNet2(torch.nn.Module):
    """The network. It starts as the Laplacian: the last layer is zero."""

    def __init__(self, hidden: int, activation: str) -> None:
        super().__init__()
        self.activation = activation
        self.encode: torch.nn.Linear = torch.nn.Linear(5, hidden)
        self.pool: torch.nn.Linear = torch.nn.Linear(2 * hidden, hidden)
        self.triangle: torch.nn.Linear = torch.nn.Linear(hidden, hidden)
        self.context: torch.nn.Linear = torch.nn.Linear(hidden, hidden, bias=False)
        self.decode: torch.nn.Linear = torch.nn.Linear(hidden, 3)
        torch.nn.init.zeros_(self.decode.weight)
        torch.nn.init.zeros_(self.decode.bias)

    def forward(self, ring: torch.Tensor, degree: torch.Tensor) -> torch.Tensor:
        """(B × 2) the shift of each free node, in the units of the ring.

        ring: (B × M × 2) relative to the free node, counter-clockwise, padded; degree: (B,).
        """
        sigma = ACTIVATIONS[self.activation]
        column = torch.arange(ring.shape[1])
        inside = column < degree[:, None]
        count = degree.to(ring.dtype)[:, None]
        before = torch.where(column == 0, degree[:, None] - 1, column - 1).clamp(min=0)
        b = ring
        a = ring.gather(1, before[:, :, None].expand(-1, -1, 2))
        (ax, ay), (bx, by) = a.unbind(2), b.unbind(2)
        aa, bb = ax * ax + ay * ay, bx * bx + by * by
        d = torch.where(inside, ax * by - ay * bx, 0.0)
        ex, ey = bx - ax, by - ay

        mean_d = (d.sum(dim=1, keepdim=True) / count).clamp(min=TINY)
        mean_aa = (torch.where(inside, bb, 0.0).sum(dim=1, keepdim=True) / count).clamp(min=TINY)
        quality = math.sqrt(3.0) * d / (aa + bb - (ax * bx + ay * by)).clamp(min=TINY)
        skew = (aa - bb) / (aa + bb).clamp(min=TINY)
        features = torch.stack(
            [
                quality,
                -0.25 * quality.clamp(min=LEAST).log(),
                0.25 * (d / mean_d).clamp(min=LEAST).log(),
                skew * skew,
                0.5 * ((ex * ex + ey * ey) / mean_aa).clamp(min=LEAST).log(),
            ],
            dim=2,
        )  # (B × M × 5)

        h = sigma(self.encode(features))  # (B × M × H)
        mean = torch.where(inside[:, :, None], h, 0.0).sum(dim=1) / count
        highest = torch.where(inside[:, :, None], h, -math.inf).amax(dim=1)
        c = sigma(self.pool(torch.cat([mean, highest], dim=1)))  # (B × H)
        o0, o1, o2 = self.decode(sigma(self.triangle(h) + self.context(c)[:, None])).unbind(2)  # (B × M) each

        weight = torch.where(inside, o0.clamp(-CLIP, CLIP), -math.inf).softmax(dim=1)
        along = o2 * skew
        vx = 0.5 * (ax + bx) - o1 * ey + along * ex
        vy = 0.5 * (ay + by) + o1 * ex + along * ey
        shift = torch.stack([(weight * vx).sum(dim=1), (weight * vy).sum(dim=1)], dim=1)
        laplacian = torch.where(inside[:, :, None], ring, 0.0).sum(dim=1) / count
        tangled = (inside & (d <= 0)).any(dim=1, keepdim=True)
        return torch.where(tangled, laplacian, shift)

    def propose(self, stars: Stars) -> NDArray[np.float64]:
        """(B × 2) the shift of each free node in the units of its mesh."""
        dtype = next(self.parameters()).dtype
        with torch.no_grad():
            shift = self(torch.as_tensor(stars.ring, dtype=dtype), torch.as_tensor(stars.degree))
        return np.asarray(shift.double().numpy() * stars.size[:, None])

    def tensors(self) -> dict[str, NDArray[np.float32]]:
        """The parameters under the names of the weights file."""
        return {name: value.detach().to(torch.float32).numpy().copy() for name, value in self.state_dict().items()}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, NDArray[np.float32]], activation: str) -> GMSNet2:
        """The network with these parameters (names of the weights file)."""
        net = cls(len(tensors["encode.bias"]), activation)
        net.load_state_dict({name: torch.tensor(tensors[name]) for name in shapes.gmsnet2(net.encode.out_features)})
        return net
