"""What ``gmsnet deform`` says about what it did, as text and as JSON."""

from __future__ import annotations

from gmsnet.cli.smooth_report import Outcome
from gmsnet.run.deform_result import MovedAccount


class MovedOutcome(MovedAccount, Outcome):
    """A finished run of ``deform`` on a file."""
