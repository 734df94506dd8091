"""Time and actions of real recordings; skipped where these are not."""

from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc

DATA = Path(__file__).parents[3] / "shared" / "data"

pytestmark = pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not part of the project")


def test_commanded_joint_angles_are_told_from_velocities():
    source = uc.open(DATA / "lerobot")
    demos = source.load()
    assert any("commanded states" in note and "action_is=" in note for note in demos.notes)
    assert demos.notes[-1] == "read: 2399 samples, 6 episodes, 6 files, 30 Hz, 79.77 s, time in s"
    # Joints of a person's arm, led at ease: some radians a second, and at rest where the episode's mean is taken.
    assert np.percentile(np.linalg.norm(demos.actions, axis=1), 99) < 5
    taken = uc.load(DATA / "lerobot", action_is="velocity")
    assert not np.allclose(taken.actions, demos.actions)
    streamed = uc.fit_stream(uc.ParametricPolicy(risk="direct", alpha=1.0), source)
    loaded = uc.ParametricPolicy(risk="direct", alpha=1.0).fit(demos.states, demos.actions)
    np.testing.assert_allclose(streamed.predict(demos.states), loaded.predict(demos.states), atol=1e-6)
    assert streamed.recording_[1].action_is == "target"
    assert tuple(map(str, source.notes)) == demos.notes
