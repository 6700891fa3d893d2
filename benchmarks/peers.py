"""gmsnet against every other tool that is installed, on the same meshes, each in a process of its own with one thread.

    python benchmarks/peers.py [--nodes 1e4 1e5] [--meshes random jittered] [--peers NAME ...] [--repeats 5]
        [--patience 20] [--limit 1800] [--keep] [--list] [--folder build/peers] [--docs docs/performance.md]

What is measured and how: peers/__init__.py. Which tools there are, with their options: peers/table.py. What to install:
peers/requirements.txt.
"""

from peers.command import main

if __name__ == "__main__":
    main()
