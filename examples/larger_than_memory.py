"""
Recordings larger than memory
=============================

For people whose recordings do not fit into memory, or come in day by day. A stream reads them in blocks, once,
and learns what a fit of all of them would learn: whatever the model, data enter through sums.
"""

import tempfile
import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle, demonstrate

# %%
# A folder of Parquet files, as a recorder writes one a day: ten files of 40 movements each, all bent, with 5 %
# noise. It is small, so that this page is built in seconds; the same call takes what is a thousand times larger.

folder = Path(tempfile.mkdtemp())
for day in range(10):
    demos = demonstrate(40, noise=0.05, random_state=day)
    columns = [*demos.states.T, *demos.actions.T, [f"{day}-{episode}" for episode in demos.episodes]]
    pq.write_table(pa.table(columns, names=["x", "y", "u", "v", "run"]), folder / f"day{day}.parquet")

recordings = uc.open(folder, state=["x", "y"], action=["u", "v"], episode="run")

# %%
# ``risk="corrected"`` finds the noise and takes away what it adds, in one pass. It is for recordings that are
# mostly bent; the default finds out which samples were free, and reads them some dozen times.

all_of_them = recordings.load()
begun = time.perf_counter()
policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk="corrected")
uc.fit_stream(policy, recordings, batch_rows=2_000)
print(f"one pass over {len(all_of_them)} samples: {time.perf_counter() - begun:.1f} s")

# %%
# In memory it is the same policy, up to rounding.

in_memory = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk="corrected").fit(all_of_them)
grid = np.stack(np.meshgrid(*2 * [np.linspace(-1, 1, 25)]), axis=-1).reshape(-1, 2)
apart = np.abs(policy.predict(grid) - in_memory.predict(grid)).max()
print(f"largest difference from the fit in memory: {apart:.1e}")

# %%
# A recorder brings another file each day. It is added to what was learnt, and no file is read again.

truth = LimitCycle()(grid)


def error(policy):
    """Return the squared error all over the square, as a share of the true policy's variance."""
    return uc.metrics.normalized(uc.metrics.unconstrained_policy_error(truth, policy.predict(grid)), truth)


errors = {"corrected": [], "direct": []}
for risk, row in errors.items():
    daily = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk=risk)
    for day in range(10):
        one = uc.open(folder / f"day{day}.parquet", state=["x", "y"], action=["u", "v"], episode="run")
        uc.fit_stream(daily, one, partial=True)
        row.append(error(daily))
    print(f"{risk}: nUPE after a day {row[0]:.4f}, after ten {row[-1]:.4f}")

# %%
# More data make the policy better, and leave ordinary regression where it was.

figure, ax = plt.subplots(figsize=(6, 4), layout="constrained")
ax.semilogy(range(1, 11), errors["corrected"], "o-", label="learnt, day by day")
ax.semilogy(range(1, 11), errors["direct"], "s--", label="ordinary regression")
ax.set(xlabel="days", ylabel="error of the policy (nUPE)", ylim=(None, 1))
ax.legend()
figure.savefig("larger_than_memory.png")
plt.show()
