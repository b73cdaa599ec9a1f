#!/usr/bin/env python3
"""Trains the network of Wang et al. (2020) with calib, vectorised numpy, scikit-learn and PyTorch: one core, one session, same rows.

    python3 -m venv VENV && VENV/bin/pip install numpy scikit-learn torch pyarrow      # torch for CPU is enough
    VENV/bin/python tests/reference/training_speed.py [--calib target/debug/calib] [--quick]

Data: the 200 training and 200 other points of `pipelines/sr210d`, what its stiffness stage leaves over, inputs and outputs
standardised. Network: 6-12-3, sigmoid, decay as chosen there.

- Swarm: 50 beetles, 200 generations, 30,050 evaluations of the loss. numpy evaluates a whole generation by matrix products,
  in place where it can; the same algorithm and parameters as calib's, other random numbers.
- Gradient: from the same starts; scikit-learn's MLPRegressor (L-BFGS) trains until it stops, at most 200 iterations. The loss that it
  ends at is what the others must reach: calib's time and PyTorch's (L-BFGS with strong Wolfe steps) are until they are there.
  Where one does not get there from a start, what it spent counts and it goes on from the next start.

calib runs as the bench binary (`cargo bench -- train`, or the binary that CALIB_BENCH names). Least wall time of several runs, every program on one thread.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
import warnings

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
import pyarrow.parquet as pq

ROOT = pathlib.Path(__file__).resolve().parents[2]
HIDDEN, OUTPUTS, DECAY = 12, 3, 1.0
BEETLES, GENERATIONS, SEEDS, STARTS = 50, 200, 20, 10


def recorded(calib):
    """Joints and residuals (mm) of the training and of the other rows."""
    with tempfile.TemporaryDirectory() as store:
        command = [calib, "run", ROOT / "pipelines/sr210d/pipeline.yaml", "--until", "stiffness", "--quiet", "--store", store]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(done.stderr)
        prediction = pq.read_table(f"{store}/tables/sr210d/stiffness.prediction.parquet").to_pydict()
        recording = pq.read_table(f"{store}/tables/sr210d/simulate.recording.parquet").to_pydict()
    joints = dict(zip(recording["sequence"], zip(*(recording[f"q{j}_rad"] for j in range(1, 7)))))
    out = []
    for chosen in ("learn", "check"):
        rows = [i for i, name in enumerate(prediction["set"]) if name == chosen]
        out.append(np.array([joints[prediction["sequence"][i]] for i in rows]))
        out.append(np.array([[prediction[f"d{axis}_mm"][i] for axis in "xyz"] for i in rows]))
    return out


def split(w, inputs):
    """Weights and biases of a population `w`, a row each."""
    a, b = HIDDEN * inputs, HIDDEN * inputs + HIDDEN
    c = b + OUTPUTS * HIDDEN
    return w[:, :a].reshape(-1, HIDDEN, inputs), w[:, a:b, None], w[:, b:c].reshape(-1, OUTPUTS, HIDDEN), w[:, c:, None]


class Vectorised:
    """The loss of a whole population in numpy."""

    def __init__(self, x, y):
        self.x, self.y, self.rows, self.inputs = np.ascontiguousarray(x.T), np.ascontiguousarray(y.T), len(x), x.shape[1]
        self.size = HIDDEN * self.inputs + HIDDEN + OUTPUTS * HIDDEN + OUTPUTS

    def forward(self, w):
        a, b, c, d = split(w, self.inputs)
        hidden = np.matmul(a, self.x)
        hidden += b
        np.negative(hidden, out=hidden)
        np.exp(hidden, out=hidden)
        hidden += 1
        np.reciprocal(hidden, out=hidden)
        return np.matmul(c, hidden) + d

    def __call__(self, w):
        a, _, c, _ = split(w, self.inputs)
        error = self.forward(w)
        error -= self.y
        squares = np.einsum("bij,bij->b", error, error)
        weights = np.einsum("bij,bij->b", a, a) + np.einsum("bij,bij->b", c, c)
        return (0.5 * squares + 0.5 * DECAY * weights) / self.rows


def swarm(loss, seed, bound=1.0, share=0.6, pull=2.0, inertia=(0.9, 0.4), fastest=0.2):
    """Beetle swarm optimisation with calib's parameters (src/numerics/estimate/swarm/beetle_swarm.rs); the best value."""
    rng = np.random.default_rng(seed)
    shape, limit = (BEETLES, loss.size), 2 * bound * fastest
    x, v = rng.uniform(-bound, bound, shape), limit * rng.uniform(-1, 1, shape)
    antenna, step = 2.0, 0.5
    own, value = x.copy(), loss(x)
    best = own[value.argmin()].copy()
    for generation in range(1, GENERATIONS + 1):
        v *= inertia[0] - (inertia[0] - inertia[1]) * generation / GENERATIONS
        v += pull * rng.random(shape) * (own - x) + pull * rng.random(shape) * (best - x)
        np.clip(v, -limit, limit, out=v)
        reach = antenna / 2 * v
        ends = np.concatenate([x + reach, x - reach])
        np.clip(ends, -bound, bound, out=ends)
        smell = loss(ends)
        turn = -step * np.sign(smell[:BEETLES] - smell[BEETLES:])
        x = x + (share + (1 - share) * turn[:, None]) * v
        np.clip(x, -bound, bound, out=x)
        now = loss(x)
        better = now < value
        own[better], value[better] = x[better], now[better]
        best = own[value.argmin()].copy()
        antenna, step = 0.95 * antenna + 0.01, 0.95 * step
    return value.min()


def least(runs, work):
    best = np.inf
    for _ in range(runs):
        begun = time.perf_counter()
        result = work()
        best = min(best, time.perf_counter() - begun)
    return best, result


def sklearn_trained(x, y, start, runs):
    """Seconds, loss as calib counts it, and parameters."""
    from sklearn.neural_network import MLPRegressor

    def fresh(iterations):
        # It averages over outputs too and adds alpha / 2 |w|^2 / rows.
        return MLPRegressor(hidden_layer_sizes=(HIDDEN,), activation="logistic", solver="lbfgs", alpha=DECAY / OUTPUTS, max_iter=iterations, tol=1e-9,
                            warm_start=True, random_state=0)

    a, b, c, d = split(start[None], x.shape[1])
    best = np.inf
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(runs):
            network = fresh(1).fit(x, y)
            network.set_params(max_iter=200)
            network.coefs_ = [a[0].T.copy(), c[0].T.copy()]
            network.intercepts_ = [b[0, :, 0].copy(), d[0, :, 0].copy()]
            begun = time.perf_counter()
            network.fit(x, y)
            best = min(best, time.perf_counter() - begun)
    parameters = np.concatenate([network.coefs_[0].T.ravel(), network.intercepts_[0], network.coefs_[1].T.ravel(), network.intercepts_[1]])
    return best, parameters, network.n_iter_


def torch_trained(x, y, start, target, most=2000):
    """Seconds until the loss is at most `target`, whether it was, and parameters."""
    import torch

    torch.set_num_threads(1)
    x, y = torch.tensor(x), torch.tensor(y)
    a, b, c, d = (torch.tensor(part[0].copy(), requires_grad=True) for part in split(start[None], x.shape[1]))
    optimiser = torch.optim.LBFGS([a, b, c, d], max_iter=most, max_eval=2 * most, tolerance_grad=0, tolerance_change=0,
                                  history_size=10, line_search_fn="strong_wolfe")

    class Reached(Exception):
        pass

    def closure():
        optimiser.zero_grad()
        hidden = torch.sigmoid(torch.addmm(b.T, x, a.T))
        error = torch.addmm(d.T, hidden, c.T) - y
        loss = (0.5 * (error * error).sum() + 0.5 * DECAY * ((a * a).sum() + (c * c).sum())) / len(x)
        if loss.item() <= target:
            raise Reached
        loss.backward()
        return loss

    begun, reached = time.perf_counter(), False
    try:
        optimiser.step(closure)
    except Reached:
        reached = True
    seconds = time.perf_counter() - begun
    parameters = np.concatenate([part.detach().numpy().ravel() for part in (a, b, c, d)])
    return seconds, reached, parameters


def until_reached(results):
    """Seconds for each loss, what was spent in vain before it included: starts in turn until one gets there."""
    spent, out = 0.0, []
    for seconds, reached in results:
        spent += seconds
        if reached:
            out.append(spent)
            spent = 0.0
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calib", default=ROOT / "target/debug/calib")
    parser.add_argument("--quick", action="store_true", help="fewer runs and starts")
    arguments = parser.parse_args()
    runs, starts, seeds = (3, 3, 3) if arguments.quick else (7, STARTS, SEEDS)

    x, residual, other, other_residual = recorded(arguments.calib)
    mean, scale, centre, size = x.mean(0), x.std(0), residual.mean(0), residual.std(0)
    x, other, y = (x - mean) / scale, (other - mean) / scale, (residual - centre) / size
    loss = Vectorised(x, y)
    held_out = Vectorised(other, (other_residual - centre) / size)

    def ratio(parameters):
        left = other_residual - (held_out.forward(np.asarray(parameters)[None])[0].T * size + centre)
        return np.linalg.norm(left, axis=1).mean() / np.linalg.norm(other_residual, axis=1).mean()

    rng = np.random.default_rng(20200116)
    begin = rng.uniform(-1, 1, (starts, loss.size))
    learned = [sklearn_trained(x, y, start, runs) for start in begin]
    targets = [float(loss(parameters[None])[0]) for _, parameters, _ in learned]

    problem = {"x": x.tolist(), "y": y.tolist(), "hidden": HIDDEN, "decay": DECAY, "beetles": BEETLES, "generations": GENERATIONS,
               "seeds": seeds, "starts": begin.tolist(), "targets": [[target] for target in targets]}
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(problem, file)
        file.flush()
        command = os.environ.get("CALIB_BENCH", "cargo bench --quiet --bench bench --").split()
        done = subprocess.run(command + ["train", file.name], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        sys.exit(done.stderr)
    ours = json.loads(done.stdout.strip().splitlines()[-1])

    print(f"{len(x)} rows, 6-{HIDDEN}-3, decay {DECAY}, one core each; numpy {np.__version__}\n")
    print(f"swarm of {BEETLES} beetles, {GENERATIONS} generations, {ours['swarm']['evaluations']} evaluations of the loss")
    seconds, _ = least(runs, lambda: swarm(loss, 1))
    values = [swarm(loss, seed) for seed in range(1, seeds + 1)]
    for program, time_, found in (("calib", ours["swarm"]["seconds"], ours["swarm"]["losses"]), ("numpy", seconds, values)):
        print(f"  {program:<14} {time_ * 1e3:8.1f} ms {time_ / ours['swarm']['seconds']:7.2f} x   "
              f"loss found: median {statistics.median(found):.4f} of {seeds} seeds")

    print(f"\ngradient, {starts} starts, to the loss at which scikit-learn ends (median {statistics.median(targets):.5f})")
    trained = ours["trained"]
    calib = until_reached((t["seconds"], t["reached"]) for t in trained)
    rows = [("calib", calib, [ratio(t["parameters"]) for t in trained if t["reached"]],
             f"median {statistics.median(t['iterations'] for t in trained):.0f} iterations"),
            ("scikit-learn", [t[0] for t in learned], [ratio(t[1]) for t in learned],
             f"median {statistics.median(t[2] for t in learned):.0f} iterations")]
    try:
        torch_trained(x, y, begin[0], targets[0])  # the first call loads what the others use
        results = [min((torch_trained(x, y, start, target) for _ in range(runs)), key=lambda run: run[0])
                   for start, target in zip(begin, targets)]
        rows.append(("PyTorch", until_reached(t[:2] for t in results), [ratio(t[2]) for t in results if t[1]], "L-BFGS, float64"))
    except ModuleNotFoundError as fault:
        print(f"  PyTorch        not compared: {fault}")
    for program, times, ratios, note in rows:
        if not times:
            print(f"  {program:<14} did not get there from any start")
            continue
        each = statistics.median(times)
        print(f"  {program:<14} {each * 1e3:8.2f} ms {each / statistics.median(calib):7.2f} x   reached from {len(ratios)} of {starts} starts, "
              f"held-out ratio after/before median {statistics.median(ratios):.3f}; {note}")


if __name__ == "__main__":
    main()
