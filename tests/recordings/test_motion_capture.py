"""Motion capture: exports of Vicon, Motive and OpenSim, and C3D."""

from pathlib import Path

import numpy as np
import pytest

import unconstrain as uc
from unconstrain.errors import DataError

LOGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "logs"
recorded = pytest.mark.skipif(not LOGS.is_dir(), reason="the recordings are not part of the project")

TIME = np.arange(30) / 10
HAND = np.column_stack([1 + 2 * TIME, 5 - TIME, 0 * TIME])
OTHER = [["", "", ""] if i == 4 else [1, i, 2] for i in range(30)]


def lines(mark, *columns, first=()):
    rows = zip(*first, HAND.tolist(), OTHER, strict=True)
    return "".join(mark.join(str(x) for x in (*row[:-2], *row[-2], *row[-1])) + "\n" for row in rows)


def vicon():
    devices = "Devices\n100\n,,Force,,\nFrame,Sub Frame,Fx,Fy,Fz\n,,N,N,N\n"
    devices += "".join(f"{i // 10 + 1},{i % 10},{i},2,3\n" for i in range(300))
    head = "Trajectories\n10\n,,LHand,,,RHand,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
    return devices + "\n" + head + lines(",", first=(range(1, 31), [0] * 30))


def motive(time=True):
    stamps = (",Time (Seconds)",) if time else ("",)
    second = "," if time else ""
    head = "Format Version,1.23,Export Frame Rate,10.0,Rotation Type,Quaternion,Length Units,Meters\n\n"
    head += f",{'Type' if time else ''}{second}Marker,Marker,Marker,Rigid Body,Rigid Body,Rigid Body\n"
    head += f",{'Name' if time else ''}{second}LHand,LHand,LHand,RHand,RHand,RHand\n"
    head += f",{second}Position,Position,Position,Rotation,Rotation,Rotation\n"
    head += f"Frame{stamps[0]},X,Y,Z,X,Y,Z\n"
    return head + lines(",", first=(range(30), TIME.tolist()))


def trc():
    head = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n10\t10\t30\t2\tmm\n"
    head += "Frame#\tTime\tLHand\t\t\tRHand\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
    return head + lines("\t", first=(range(1, 31), TIME.tolist()))


def mot(mark="\t"):
    names = mark.join(["time", "LHand.X", "LHand.Y", "LHand.Z"])
    head = f"coords\nversion=1\nnRows=30\nnColumns=4\ninDegrees=yes\nendheader\n{names}\n"
    return head + "".join(mark.join(map(str, (t, *x))) + "\n" for t, x in zip(TIME, HAND, strict=True))


@pytest.mark.parametrize(
    ("content", "time", "said"),
    [
        (vicon(), "time", ["rate of the header, 10 Hz", "units are mm", "of its parts Trajectories is read"]),
        (motive(), "Time (Seconds)", ["lengths are meters", "rotations are quaternion"]),
        (trc(), "Time", ["units are mm"]),
        (mot(), "time", ["angles are in degrees"]),
        (mot("   "), "time", ["angles are in degrees"]),
    ],
)
def test_header_blocks(tmp_path, content, time, said):
    path = tmp_path / "a.txt"
    path.write_text(content)
    demos = uc.load(path, state="LHand", time=time, window=0.3)
    assert demos.state_names == ("LHand.X", "LHand.Y", "LHand.Z")
    np.testing.assert_allclose(demos.states, HAND)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert len(demos.notes[:-1]) == len(said)
    for note, words in zip(demos.notes[:-1], said, strict=True):
        assert words in note
    if "RHand" in content:
        column = "RHand.QX" if content.startswith("Format") else "RHand.X"
        line = 5 + content.splitlines().index(
            next(x for x in content.splitlines() if "1.0" in x.replace("\t", ",") and "5.0" in x)
        )
        with pytest.raises(DataError, match=rf"column '{column}' is empty at line {line}"):
            uc.load(path, state=column, time=time)


def test_devices_have_frames_within_frames(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(vicon().split("\nTraj")[0])
    demos = uc.load(path, state="Force", time="time")
    np.testing.assert_allclose(demos.time, np.arange(300) / 100)
    assert demos.states[-1].tolist() == [299, 2, 3]


@recorded
@pytest.mark.parametrize(
    ("name", "state", "time", "samples", "rate"),
    [
        ("vicon_markers.csv", "Daphnee:WRIST", "time", 295, 100),
        ("motive.csv", ["device03.X", "device03.Y", "device03.Z"], "Time (Seconds)", 293, 100),
        ("freiburg1_xyz-groundtruth.txt", ["tx", "ty", "tz"], "timestamp", 397, 100),
    ],
)
def test_real_files(name, state, time, samples, rate):
    demos = uc.load(LOGS / name, state=state, time=time)
    assert len(demos) == samples
    assert demos.n_episodes == 1
    assert (samples - 1) / demos.time[-1] == pytest.approx(rate, rel=0.02)


def c3d(path, **parameters):
    ezc3d = pytest.importorskip("ezc3d")
    held = ezc3d.c3d()
    points = np.ones((4, 2, 30))
    points[:3, 0] = HAND.T
    residuals = np.zeros((1, 2, 30))
    residuals[0, 1, 4] = -1
    about = {"RATE": [10.0], "LABELS": ["LHand", "RHand"], "UNITS": ["mm"]} | parameters
    for name, value in about.items():
        held["parameters"]["POINT"][name]["value"] = value
    held["data"]["points"] = points
    held["data"]["meta_points"] = {"residuals": residuals, "camera_masks": np.zeros((7, 2, 30), bool)}
    held.write(str(path))
    return path


def test_c3d(tmp_path):
    demos = uc.load(c3d(tmp_path / "a.c3d"), state="LHand", time="time")
    assert demos.state_names == ("LHand.X", "LHand.Y", "LHand.Z")
    np.testing.assert_allclose(demos.states, HAND, rtol=1e-6)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert "10 Hz" in demos.notes[0]
    assert "units are mm" in demos.notes[1]
    with pytest.raises(DataError, match=r"column 'RHand.X' is empty at row 4"):
        uc.load(tmp_path / "a.c3d", state="RHand", time="time")


def test_a_c3d_file_that_was_cut_is_one_sentence(tmp_path):
    whole = c3d(tmp_path / "a.c3d").read_bytes()
    for length in (20, 100, 600, 1200, len(whole) - 200):
        (tmp_path / "b.c3d").write_bytes(whole[:length])
        with pytest.raises(DataError, match=r"b.c3d is damaged"):
            uc.load(tmp_path / "b.c3d", state="LHand", time="time")
