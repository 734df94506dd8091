"""Local models are evaluated as they are defined."""

import numpy as np
import pytest

from unconstrain.features import FullFeatures
from unconstrain.fitting.local_models import LocalModels
from unconstrain.receptive import normalized_activations


@pytest.mark.parametrize("N", [1, 5000])
def test_blended_parameters_predict_what_blended_predictions_are(N):
    rng = np.random.default_rng(0)
    X, centers, w = rng.normal(size=(N, 3)), rng.normal(size=(6, 3)), rng.normal(size=(6, 8))
    features = FullFeatures().fit(X, 2)
    blend = normalized_activations(X, centers, 0.7)
    each = np.stack([features.evaluate(X, one) for one in w], axis=1)
    found = LocalModels(features, centers, 0.7, 2).evaluate(X, w)
    np.testing.assert_allclose(found, np.einsum("nm,nmd->nd", blend, each), rtol=1e-10, atol=1e-12)
