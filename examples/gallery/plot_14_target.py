"""
A target in CI: exit codes
==========================

The command line ends with 0 where each cell reaches the target, with 1 where some miss it. It ends
with 2 where the input is of no use.
"""

import json
import subprocess


def run(command: str) -> subprocess.CompletedProcess[str]:
    """Runs a command and shows what it prints."""
    done = subprocess.run(command.split(), capture_output=True, text=True)
    print(f"$ {command}\n{done.stdout}{done.stderr}exit code {done.returncode}\n")
    return done


run("gmsnet generate bad.su2 --nodes 500 --seed 1")
assert run("gmsnet quality bad.su2 --threshold 0.3").returncode == 1
assert run("gmsnet smooth bad.su2 good.su2 --target-quality 0.3").returncode == 0
assert run("gmsnet quality good.su2 --threshold 0.3").returncode == 0

# %%
# ``--json`` gives the same to programs.

report = json.loads(run("gmsnet quality good.su2 --threshold 0.3 --json").stdout)
print(sorted(report))
