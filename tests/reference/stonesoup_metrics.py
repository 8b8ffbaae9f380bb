"""Reference values of GOSPA and OSPA for `src/evaluate/score.rs`, by Stone Soup (pip install stonesoup).

Prints the Rust table of the test: twenty small cases with the GOSPA (p = 2, alpha = 2) that Stone
Soup computes, the OSPA (p = 2) by its definition over all permutations, and the F1 that scipy's
assignment gives at a radius. Stone Soup 1.9.1 assigns by the distances and not by their squares
before it takes the OSPA, which is not the least over all permutations where p = 2; where its value
differs, the script says so. Run by hand: the numbers stand in the test.
"""

import datetime
import itertools
import sys

import numpy as np
from scipy.optimize import linear_sum_assignment
from stonesoup.metricgenerator.ospametric import GOSPAMetric, OSPAMetric
from stonesoup.types.array import StateVector
from stonesoup.types.state import State

NOW = datetime.datetime(2000, 1, 1)


def states(points):
    return [State(StateVector(p), timestamp=NOW) for p in points]


def f1(estimates, truths, radius):
    if not estimates and not truths:
        return None
    if not estimates or not truths:
        return 0.0
    gaps = np.linalg.norm(np.array(estimates)[:, None] - np.array(truths)[None], axis=2)
    i, j = linear_sum_assignment(np.minimum(gaps, radius) ** 2)
    matched = int((gaps[i, j] < radius).sum())
    return 2 * matched / (len(estimates) + len(truths))


def ospa_of(estimates, truths, cutoff):
    """Schuhmacher, Vo, Vo 2008, equation 3, by trying every permutation."""
    few, many = sorted([estimates, truths], key=len)
    gaps = np.array([[min(np.hypot(a[0] - b[0], a[1] - b[1]), cutoff) for b in many] for a in few])
    best = min(
        sum(gaps[i][j] ** 2 for i, j in enumerate(chosen))
        for chosen in itertools.permutations(range(len(many)), len(few))
    )
    return ((best + cutoff**2 * (len(many) - len(few))) / len(many)) ** 0.5


def cases():
    yield [], [[0.0, 0.0]], 0.5, 0.3
    yield [[0.0, 0.0]], [], 0.5, 0.3
    yield [[0.1, 0.0]], [[0.0, 0.0]], 0.5, 0.3
    yield [[0.4, 0.0]], [[0.0, 0.0]], 0.5, 0.3
    yield [[0.6, 0.0]], [[0.0, 0.0]], 0.5, 0.3
    yield [[0.1, 0.0], [0.2, 0.0]], [[0.0, 0.0]], 0.5, 0.3
    yield [[0.1, 0.0], [0.2, 0.0]], [[0.0, 0.0], [0.3, 0.0]], 0.5, 0.3
    yield [[0.25, 0.0], [0.75, 0.0]], [[0.0, 0.0], [0.5, 0.0]], 0.5, 0.3
    yield [[0.0, 0.0], [5.0, 5.0]], [[0.1, 0.1], [9.0, 9.0]], 0.5, 0.3
    yield [[0.0, 0.2], [0.0, -0.2]], [[0.0, 0.0]], 1.0, 0.25
    rng = np.random.default_rng(20)
    for n_estimates, n_truths in [(3, 3), (4, 2), (2, 5), (6, 6), (1, 7), (7, 1), (5, 5), (8, 6), (6, 8), (9, 9)]:
        spread = rng.choice([0.6, 1.2, 2.5])
        draw = lambda n: rng.uniform(0, spread, (n, 2)).round(2).tolist()
        yield draw(n_estimates), draw(n_truths), float(rng.choice([0.5, 1.0])), 0.3


def rust(points):
    return "&[" + ", ".join(f"[{x!r}, {y!r}]" for x, y in points) + "]"


def main():
    for estimates, truths, cutoff, radius in cases():
        gospa = GOSPAMetric(c=cutoff, p=2).compute_gospa_metric(states(estimates), states(truths))[0].value
        ospa = ospa_of(estimates, truths, cutoff)
        if estimates and truths:
            other = OSPAMetric(c=cutoff, p=2).compute_OSPA_distance(states(estimates), states(truths)).value
            if abs(ospa - other) > 1e-9:
                print(f"OSPA {ospa!r}, by Stone Soup {other!r}", file=sys.stderr)
        parts = [float(gospa[k]) for k in ("distance", "localisation", "missed", "false")]
        print(f"    ({rust(estimates)}, {rust(truths)}, {cutoff}, {radius}, "
              f"{parts}, {float(ospa)!r}, {f1(estimates, truths, radius)!r}),")


if __name__ == "__main__":
    main()
