"""The one place that imports torch and PyTorch Geometric."""

from __future__ import annotations

import warnings

from gmsnet.errors import MissingExtraError

try:
    import torch
    from torch.optim.lr_scheduler import LambdaLR, ReduceLROnPlateau

    with warnings.catch_warnings():
        # PyTorch Geometric compiles some of its own layers with torch.jit when it is imported.
        warnings.filterwarnings("ignore", message=r".*torch\.jit", category=DeprecationWarning)
        from torch_geometric.data import Data
        from torch_geometric.nn import GCNConv, GraphNorm
        from torch_geometric.nn.conv.gcn_conv import gcn_norm
except ModuleNotFoundError as _error:
    if _error.name not in ("torch", "torch_geometric"):
        raise  # it is there, but something that it needs is not
    raise MissingExtraError(
        f'training needs {_error.name}, which is not installed: install the extra "train", in the folder of the '
        'sources by pip install ".[train]"'
    ) from _error

__all__ = ["Data", "GCNConv", "GraphNorm", "LambdaLR", "ReduceLROnPlateau", "gcn_norm", "torch"]
