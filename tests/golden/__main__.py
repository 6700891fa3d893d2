"""Writes the hashes anew, and says which have changed."""

from __future__ import annotations

import json
import os

from golden import FILE, all_results, recorded

if not os.environ.get("GMSNET_MESHES"):
    raise SystemExit("GMSNET_MESHES must name the folder of real meshes")
old = recorded() if FILE.exists() else {}
new = all_results()
changed = [
    f"{mesh}: {row}" for mesh, rows in new.items() for row, now in rows.items() if old.get(mesh, {}).get(row) != now
]
print("\n".join(changed) or "nothing has changed")
FILE.write_text(json.dumps(new, indent=1) + "\n")
