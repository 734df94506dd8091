"""A person's fingertip on a flat and on a curved surface: the surfaces found in the motion alone."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from unconstrain import metrics as risk
from unconstrain.constraints.learnt import ConstantConstraint, FeatureConstraint
from unconstrain.constraints.learnt.base import held_out_projections
from unconstrain.demonstrations import Demonstrations
from unconstrain.features import NormalizedRBF
from unconstrain.fitting.solve import splits
from unconstrain.policies import LocallyLinearPolicy, ParametricPolicy
from unconstrain.recordings import load

Array = NDArray[np.float64]

FLAT, CURVED = "planer_circle.csv", "curve_circle.csv"
BLOCKS = 10
CENTERS = (5, 10, 15, 20, 25)


@dataclass(frozen=True)
class Surfaces:
    """What was found: both recordings, the flat one's normal, and the held-out errors of everything tried."""

    flat: Demonstrations
    curved: Demonstrations
    normal: Array
    plane: Array
    angle: float
    uncertainty: float
    shares: Array
    flat_errors: dict[str, float]
    curved_errors: dict[str, float]
    policies: dict[str, dict[str, float]]
    best: int


def recordings(folder: Path) -> tuple[Demonstrations, Demonstrations] | None:
    """The flat and the curved recording in `folder`, or None where they are not there."""
    if not all((folder / name).is_file() for name in (FLAT, CURVED)):
        return None
    flat, curved = (
        load(folder / name, state=[1, 2, 3], time="rosbagTimestamp", max_speed=1, min_duration=1)
        for name in (FLAT, CURVED)
    )
    return flat, curved


def found(folder: Path) -> Surfaces | None:
    """The constraints of both surfaces, judged on blocks held out; None without the recordings."""
    both = recordings(folder)
    if both is None:
        return None
    flat, curved = both
    constant = ConstantConstraint(1).fit(flat.states, flat.actions, groups=flat.blocks(BLOCKS))
    plane = np.linalg.svd(flat.states - flat.states.mean(axis=0), full_matrices=False)[2][-1]
    angle = np.degrees(np.arccos(min(1.0, abs(float(plane @ constant.rows_[0])))))
    curves = {f"{n} RBFs": _held_out(FeatureConstraint(NormalizedRBF(n)), curved) for n in CENTERS}
    best = CENTERS[int(np.argmin(list(curves.values())))]
    return Surfaces(
        flat,
        curved,
        constant.rows_[0],
        plane,
        float(angle),
        float(np.degrees(constant.uncertainty_)),
        constant.shares_,
        {
            "constant row": _held_out(ConstantConstraint(1), flat),
            "plane through the points": _npoe(flat.actions, np.eye(3) - np.outer(plane, plane)),
        },
        {"constant row": _held_out(ConstantConstraint(1), curved)} | curves,
        {
            "flat": _policies(ConstantConstraint(1), flat),
            "curved": _policies(FeatureConstraint(NormalizedRBF(best)), curved),
        },
        best,
    )


def _npoe(U: Array, N: Array) -> float:
    N = np.broadcast_to(N, (len(U), *N.shape[-2:]))
    return risk.normalized(risk.projected_observation_error(U, N), U)


def _held_out(estimator: Any, D: Demonstrations) -> float:
    """nPOE on held-out blocks of constraints learnt from the others."""
    return _npoe(D.actions, held_out_projections(estimator, D.states, D.actions, D.blocks(BLOCKS)))


def _policies(estimator: Any, D: Demonstrations) -> dict[str, float]:
    """Errors on held-out blocks, as shares of the actions' variance, with and without the learnt projections.

    "inconsistency": along the recorded action alone. "constrained": of the whole action under the learnt constraint.
    """
    blocks = D.blocks(BLOCKS)
    kinds = {
        "local models": LocallyLinearPolicy(n_centers=20, alpha="cv"),
        "RBFs": ParametricPolicy(NormalizedRBF(25), alpha="cv"),
    }
    result = {}
    for kind, policy in kinds.items():
        for way in ("inconsistency", "learnt constraint"):
            P, N = np.empty_like(D.actions), np.empty((len(D), 3, 3))
            for train, test in splits(len(D), blocks):
                X, U, groups = D.states[train], D.actions[train], blocks[train]
                learnt = estimator.fit(X, U, groups=groups)
                known = learnt.predict(X) if way == "learnt constraint" else None
                P[test] = policy.fit(X, U, groups=groups, projections=known).predict(D.states[test])
                N[test] = learnt.predict(D.states[test])
            left = np.einsum("nij,nj->ni", N, D.actions - P)
            result[f"{kind}, {way}, inconsistency"] = risk.normalized(
                risk.inconsistency(D.actions, P), D.actions
            )
            result[f"{kind}, {way}, constrained"] = risk.normalized(
                float(np.mean(np.sum(left**2, axis=1))), D.actions
            )
    return result
