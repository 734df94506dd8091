"""
From a messy file to a policy
=============================

For people whose recordings come as loggers write them: semicolons, decimal commas, milliseconds, values that
are missing, a tracker that jumps. Nothing has to be cleaned by hand; what was guessed and done is said.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from sklearn.preprocessing import PolynomialFeatures

import unconstrain as uc

# %%
# The hand that wipes boards (it ships with the package, and is simulated) as a bad day would have logged it:
# positions in cm, one row in fifty with a value missing, now and then another marker taken for the hand.

rng = np.random.default_rng(0)
clean = np.loadtxt(uc.datasets.path("wiping.csv"), delimiter=",", skiprows=1)
lines = ["# logger 2.1", "Versuch;Zeit [ms];Hand x;Hand y;Hand z;Status"]
for episode in range(12):
    rows = clean[clean[:, 0] == episode]
    for _, t, *position in rows[:, :5]:
        place = 100 * np.array(position) + 0.02 * rng.normal(size=3)
        if rng.random() < 0.003:
            place += 30 * rng.normal(size=3)
        values = [f"{value:.2f}".replace(".", ",") for value in place]
        if rng.random() < 0.02:
            values[rng.integers(3)] = "NaN"
        lines.append(";".join([str(episode), str(round(1000 * t) + 5000), *values, "ok"]))
path = Path(tempfile.mkdtemp()) / "log.csv"
path.write_text("\n".join(lines), encoding="utf-8")
print(*lines[:6], sep="\n")

# %%
# What is in it, and the command to type next:

print(uc.inspect(path))

# %%
# In Python the same, with what a person knows of the day: no hand is faster than 150 cm/s. `Columns` say which
# column is what, `Preparation` what is done to them; both are kept with the policy.

columns = uc.Columns(state=["Hand x", "Hand y", "Hand z"], time="Zeit [ms]", episode="Versuch")
preparation = uc.Preparation(drop=("missing",), max_speed=150.0, min_duration=0.3)
demos = uc.load(path, columns=columns, preparation=preparation)
print(demos, *demos.notes, sep="\n")

# %%
# What is learnt from that, against the truth on recordings that are not in the file; and what is learnt without
# care for jumps.

others = uc.datasets.load_wiping()
others = others.select(others.episodes >= 12)


def error(policy):
    """Return the squared error on recordings held out, as a share of the true policy's variance."""
    predicted = policy.predict(100 * others.states) / 100
    return uc.metrics.normalized(
        uc.metrics.unconstrained_policy_error(others.policy, predicted), others.policy
    )


policy = uc.ParametricPolicy(PolynomialFeatures(3)).fit(demos)
careless = uc.load(path, columns=columns, preparation=uc.Preparation(drop=("missing",)))
print(f"prepared:            nUPE {error(policy):.4f}")
print(f"ordinary regression: nUPE {error(policy.ordinary_regression()):.4f}")
print(f"without care:        nUPE {error(uc.ParametricPolicy(PolynomialFeatures(3)).fit(careless)):.4f}")

# %%
# Speeds of a recording in which the tracker jumped. As logged, jumps are smoothed into the motion, and make the
# noise look so large that all else is smoothed over more than half a second. Prepared, the recording is split
# where they are.

jumped = next(label for label in demos.episode_labels if "/" in label).split("/")[0]
figure, ax = plt.subplots(figsize=(8, 4), layout="constrained")
for name, seen, color in (("as logged", careless, "0.6"), ("prepared", demos, "C0")):
    of_it = [label.split("/")[0] == jumped for label in seen.episode_labels]
    shown = seen.select(np.array(of_it)[seen.episodes])
    speeds = np.linalg.norm(shown.actions, axis=1)
    ax.plot(shown.time, speeds, ".", color=color, label=name, markersize=4)
ax.set(xlabel="time, s", ylabel="speed, cm/s")
ax.legend()
figure.savefig("messy_csv.png")
plt.show()
