"""Our distribution beside Table 1 of the source paper: hill climbing on its random walks.

usage: python benchmarks/paper_table.py [--seeds 500]
"""

import argparse

import numpy as np

from slicer.generate import random_walk
from slicer.hatch import hatch
from slicer.sequence import solve

PAPER = {2: (52, 224, 8.340), 4: (200, 1206, 33.644)}
NAMES = ("nodes visited", "states created", "J")
PERCENTILES = (1, 25, 50, 75, 99)


def main() -> None:
    """Print the table: the paper's figures and the percentiles of ours."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=500)
    seeds = parser.parse_args().seeds
    print(
        "| grid | figure | paper | " + " | ".join(f"{p} %" for p in PERCENTILES) + " | paper's percentile |"
    )
    print("|---" * (len(PERCENTILES) + 4) + "|")
    for tiles, figures in PAPER.items():
        rows = []
        for seed in range(seeds):
            segments = hatch(random_walk(tiles, tiles, seed=seed)).segments
            lower_end = bool(segments[0, 1, 1] < segments[0, 0, 1])
            result = solve(segments, first=0, first_flipped=lower_end, method="greedy")
            rows.append((result.nodes_visited, result.states_created, result.travel_mm))
        ours = np.array(rows)
        for k, (name, figure) in enumerate(zip(NAMES, figures, strict=True)):
            digits = 3 if name == "J" else 0
            cells = [f"{value:.{digits}f}" for value in np.percentile(ours[:, k], PERCENTILES)]
            # Counts repeat, so the middle of the equal ones is the fair place.
            rank = ((ours[:, k] < figure).mean() + (ours[:, k] <= figure).mean()) / 2
            print(f"| {tiles}x{tiles} | {name} | {figure} | {' | '.join(cells)} | {100 * rank:.0f} |")


if __name__ == "__main__":
    main()
