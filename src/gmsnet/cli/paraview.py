"""``gmsnet paraview-plugin``: where the plugin is."""

from __future__ import annotations

import sys

import typer

from gmsnet.paraview import PLUGIN


def paraview_plugin() -> None:
    """Print the path of the plugin for ParaView; how to load it is said on standard error."""
    typer.echo(str(PLUGIN))
    version = f"{sys.version_info[0]}.{sys.version_info[1]}"
    typer.echo(
        f"Load it in ParaView by Tools > Manage Plugins > Load New. ParaView's Python must be {version}, and must find "
        "gmsnet: set PYTHONPATH to the site-packages of an environment without vtk and pyvista.",
        err=True,
    )
