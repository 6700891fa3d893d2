"""ParaView: a plugin with a filter that smooths (``plugin.py``). ParaView loads that file; nothing else imports it."""

from pathlib import Path

PLUGIN = Path(__file__).with_name("plugin.py")
