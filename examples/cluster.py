"""
The same fit on a cluster
=========================

For people with a cluster, or a workstation of many cores, and recordings of hours. Workers add up their share
of the data, and the sums are the policy: it is that of one machine, to rounding. It needs the extra
`distributed`.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from distributed import Client, LocalCluster

import unconstrain as uc
from unconstrain.limit_cycle import LimitCycle, demonstrate

# %%
# Four files of 40 movements each, with 5 % noise; a tenth of what they hold is free.

folder = Path(tempfile.mkdtemp())
paths = []
for number in range(4):
    demos = demonstrate(40, noise=0.05, free=0.1, random_state=number)
    paths.append(folder / f"part{number}.csv")
    rows = np.column_stack([demos.episodes, demos.states, demos.actions])
    np.savetxt(paths[-1], rows, delimiter=",", header="run,x,y,u,v", comments="")
recordings = uc.open(paths, state=["x", "y"], action=["u", "v"], episode="run")

# %%
# Here the cluster is two threads of this process, so that the page builds anywhere. Elsewhere give `Client` the
# address of the scheduler; on the command line it is ``unconstrain fit ... --cluster tcp://scheduler:8786``.

RISK = "corrected"  # one pass over the data; the default, which finds what was free, takes dozens
policy = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk=RISK)
with (
    LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
    Client(cluster) as client,
):
    uc.distributed.fit(policy, recordings, client)

# %%
# Beside it: one machine, and ordinary regression.

alone = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk=RISK).fit(recordings.load())
grid = np.stack(np.meshgrid(*2 * [np.linspace(-1, 1, 25)]), axis=-1).reshape(-1, 2)
truth = LimitCycle()(grid)
print(f"largest difference from one machine: {np.abs(policy.predict(grid) - alone.predict(grid)).max():.1e}")
regression = uc.ParametricPolicy(uc.NormalizedRBF(n_centers=36), risk="direct").fit(recordings.load())
for name, learnt in {"cluster": policy, "ordinary regression": regression}.items():
    missed = uc.metrics.unconstrained_policy_error(truth, learnt.predict(grid))
    print(f"{name}: nUPE {uc.metrics.normalized(missed, truth):.4f}")

# %%
# What was learnt, and what ordinary regression learns from the same files.

square = [[-1, -1], [1, 1]]
figure, axes = plt.subplots(1, 2, figsize=(9, 4.5), layout="constrained", sharey=True)
for ax, (name, learnt) in zip(
    axes, {"on the cluster": policy, "ordinary regression": regression}.items(), strict=True
):
    uc.plot.policy(LimitCycle(), region=square, full_speed=1.0, color="0.7", label=None, ax=ax)
    uc.plot.policy(learnt, region=square, full_speed=1.0, label=None, ax=ax)
    ax.set_title(f"{name}, over the true policy")
figure.savefig("cluster.png")
plt.show()
