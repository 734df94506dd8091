"""
Our loss in a policy of LeRobot's kind
======================================

For people who train policies with LeRobot, or any loop of their own, on demonstrations that touch things: a table that
was wiped, a drawer that was pulled. Ordinary regression learns what the table did as if the person had wanted it. Two
lines of the policy's ``forward`` change that: the action along itself is learnt from always, the rest of it only as far
as it was free. Run it with a dataset in LeRobot's format, ``python examples/lerobot_loss.py ../shared/data/lerobot``;
without one it simulates a small dataset, and writes it in that format, so that the truth is known. It needs the extra
`torch`.
"""

# %%
# A dataset, as LeRobot lays it out
# ---------------------------------
# Parquet files with a row for each frame, columns ``observation.state`` and ``action``, and ``meta/info.json``.

import json
import sys
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import torch
import unconstrain as uc
from torch import nn

FPS, EPISODES, FRAMES = 30, 40, 60
SLOPES = np.array([[-1.2, 1.0, 0.0], [-1.0, -1.2, 0.0], [0.3, 0.0, -0.8]])


def intend(X):
    """What the person in the simulation wants: to turn in towards the origin, in units per second."""
    return np.tanh(X @ SLOPES.T)


def simulate(folder):
    """Write movements of a hand that slides on a table of another tilt each time, in the middle of each movement."""
    rng = np.random.default_rng(0)
    (folder / "meta").mkdir(parents=True)
    (folder / "data" / "chunk-000").mkdir(parents=True)
    for episode in range(EPISODES):
        x, states, actions = rng.normal(size=3), [], []
        N = uc.constraints.projection(rng.normal(size=(1, 1, 3)))[0]
        touches = range(rng.integers(5, 15), rng.integers(40, 55))
        for frame in range(FRAMES):
            u = intend(x[None])[0]
            u = N @ u if frame in touches else u
            states.append(x)
            x = x + u / FPS
            actions.append(x + 0.02 / FPS * rng.normal(size=3))
        table = pa.table(
            {
                "observation.state": pa.array([row.tolist() for row in states], pa.list_(pa.float32(), 3)),
                "action": pa.array([row.tolist() for row in actions], pa.list_(pa.float32(), 3)),
                "episode_index": pa.array([episode] * FRAMES, pa.int64()),
            }
        )
        pq.write_table(table, folder / "data" / "chunk-000" / f"episode_{episode:06d}.parquet")
    (folder / "meta" / "info.json").write_text(json.dumps({"fps": FPS, "total_episodes": EPISODES}))
    return folder


def load(folder):
    """Return the columns of all episodes as tensors, and frames per second."""
    tables = [pq.read_table(path) for path in sorted(folder.glob("data/*/*.parquet"))]
    columns = {
        name: torch.tensor(
            np.concatenate([np.stack(t[name].to_numpy()) for t in tables]), dtype=torch.float32
        )
        for name in ("observation.state", "action")
    }
    episodes = torch.tensor(np.concatenate([t["episode_index"].to_numpy() for t in tables]))
    return columns | {"episode_index": episodes}, json.loads((folder / "meta" / "info.json").read_text())[
        "fps"
    ]


given = [Path(argument) for argument in sys.argv[1:] if not argument.startswith("-")]
folder = given[0] if given else simulate(Path(tempfile.mkdtemp()) / "dataset")
dataset, fps = load(folder)
held_out = dataset["episode_index"] % 5 == 4
print(f"{len(held_out)} frames of {int(dataset['episode_index'].max()) + 1} episodes at {fps} Hz")

# %%
# A policy of LeRobot's kind, and the two lines
# ---------------------------------------------
# Actions in these files are where the joints shall be next. Constraints are about motion, so the network says a motion,
# and ``forward`` compares it with ``action - observation.state``. Where the robot was told to go through the table and
# the table stopped it, the constraint is in the states, not in the actions: compare with the motion of the states then.


class Policy(nn.Module):
    """A batch in, a loss out; `select_action` for the robot."""

    def __init__(self, states, motions, loss="mse"):
        super().__init__()
        n, d = states.shape[1], motions.shape[1]
        self.register_buffer("mean", states.mean(dim=0))
        self.register_buffer("std", states.std(dim=0).clamp(min=1e-6))
        self.size = float(motions.square().mean().sqrt())
        self.network = nn.Sequential(nn.Linear(n, 256), nn.SiLU(), nn.Linear(256, d))
        self.loss = loss
        # How noisy motions are, and how often nothing was in the way, is learnt along; noise begins large.
        self.log_noise = nn.Parameter(torch.tensor(float(np.log(0.5 * self.size))))
        self.free = nn.Parameter(torch.tensor(0.0))

    def motion(self, batch):
        return self.size * self.network((batch["observation.state"] - self.mean) / self.std)

    def forward(self, batch):
        motion = self.motion(batch)
        shown = (batch["action"] - batch["observation.state"]) * fps
        loss = nn.functional.mse_loss(motion, shown)
        if self.loss == "adaptive":
            noise = self.log_noise.exp().clamp(min=1e-3 * self.size)  # line one
            loss = uc.torch.adaptive_loss(motion, shown, noise, free_share=self.free.sigmoid())  # line two
        return {"loss": loss}

    @torch.no_grad()
    def select_action(self, batch):
        return batch["observation.state"] + self.motion(batch) / fps


def rows(which):
    return {name: column[which] for name, column in dataset.items()}


def train(loss, begin_with=None, epochs=100):
    """Descend as anyone does."""
    torch.manual_seed(0)
    learnt_from = rows(~held_out)
    shown = (learnt_from["action"] - learnt_from["observation.state"]) * fps
    policy = Policy(learnt_from["observation.state"], shown, loss)
    if begin_with is not None:
        policy.load_state_dict(begin_with.state_dict())
    optimizer = torch.optim.Adam(policy.parameters(), lr=3e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs)
    for _ in range(epochs):
        for some in torch.randperm(len(shown)).split(64):
            optimizer.zero_grad()
            policy({name: column[some] for name, column in learnt_from.items()})["loss"].backward()
            optimizer.step()
        schedule.step()
    return policy


# It begins with regression: in many dimensions a network that begins with nothing may explain all motions as what
# constraints left of a huge policy.
torch.set_num_threads(1)
regression = train("mse")
policies = {"regression": regression, "our loss": train("adaptive", begin_with=regression)}

# %%
# Which is better?
# ----------------
# Where the data are simulated the truth tells. On recordings, how likely held-out motions are tells whether anything
# was in the way: with ``free_share=1`` all is free, which is regression. What is learnt of noise and of the share of
# free frames is learnt frame by frame here; `uc.TorchPolicy` looks along episodes, which tells much more.

test = rows(held_out)
shown = (test["action"] - test["observation.state"]) * fps
with torch.no_grad():
    motions = {name: policy.motion(test) for name, policy in policies.items()}
    ours, direct = policies["our loss"], motions["regression"]
    left = float((direct - shown).square().mean().sqrt())
    likelihoods = {
        "regression, all free": -float(uc.torch.adaptive_loss(direct, shown, left, free_share=1.0)),
        "our loss": -float(
            uc.torch.adaptive_loss(
                motions["our loss"], shown, ours.log_noise.exp(), free_share=float(ours.free.sigmoid())
            )
        ),
    }
print(
    f"noise {float(ours.log_noise.exp().detach()):.3g}, share of free frames {float(ours.free.detach().sigmoid()):.0%}"
)
print("log-likelihood of a held-out frame:", {name: round(value, 2) for name, value in likelihoods.items()})
if not given:
    truth = torch.tensor(intend(test["observation.state"].double().numpy()))
    for name, motion in motions.items():
        print(
            f"{name}: {float((motion - truth).square().sum() / truth.square().sum()):.3g} of the true motion missed"
        )
elif likelihoods["our loss"] <= likelihoods["regression, all free"]:
    print("nothing speaks for constraints in these recordings: keep regression")

# %%
# The picture: one held-out episode, the coordinate in which the two differ most.

if not sys.flags.interactive and "sphinx_gallery" not in sys.modules:
    matplotlib.use("agg")
import matplotlib.pyplot as plt  # noqa: E402

episode = test["episode_index"] == test["episode_index"][0]
joint = int((motions["our loss"] - motions["regression"])[episode].square().mean(dim=0).argmax())
t = np.arange(int(episode.sum())) / fps
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.plot(t, shown[episode, joint], color="0.6", label="recorded")
for name, motion in motions.items():
    axes.plot(t, motion[episode, joint], label=name)
if not given:
    axes.plot(t, truth[episode, joint], "k--", label="what was wanted")
axes.set(xlabel="time, s", ylabel=f"motion along coordinate {joint}, per s", title="A held-out episode")
axes.legend()
figure.savefig("lerobot_loss.png", dpi=120)
