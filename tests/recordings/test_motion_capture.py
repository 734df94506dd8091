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
        (
            vicon(),
            "time",
            ["rate of the header, 10 Hz", "of its parts 'Trajectories' is read", "LHand.Z in mm"],
        ),
        (motive(), "Time (Seconds)", []),
        (trc(), "Time", ["LHand.X, LHand.Y, LHand.Z in mm"]),
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
    assert "LHand.X, LHand.Y, LHand.Z in mm" in demos.notes[1]
    with pytest.raises(DataError, match=r"column 'RHand.X' is empty at row 4"):
        uc.load(tmp_path / "a.c3d", state="RHand", time="time")


def test_a_c3d_file_that_was_cut_is_one_sentence(tmp_path):
    whole = c3d(tmp_path / "a.c3d").read_bytes()
    for length in (20, 100, 600, 1200, len(whole) - 200):
        (tmp_path / "b.c3d").write_bytes(whole[:length])
        with pytest.raises(DataError, match=r"b.c3d is damaged"):
            uc.load(tmp_path / "b.c3d", state="LHand", time="time")


def qualisys(names, stamps):
    head = "NO_OF_FRAMES\t30\nFREQUENCY\t10\nDATA_INCLUDED\t3D\nMARKER_NAMES\tLHand\tRHand\n"
    if names:
        axes = "\t".join(f"{hand} {axis}" for hand in ("LHand", "RHand") for axis in "XYZ")
        head += f"{'Frame' + chr(9) + 'Time' + chr(9) if stamps else ''}{axes}\n"
    return head + lines("\t", first=(range(1, 31), TIME.tolist()) if stamps else ())


@pytest.mark.parametrize(("names", "stamps"), [(True, True), (True, False), (False, False)])
def test_qualisys(tmp_path, names, stamps):
    path = tmp_path / "a.tsv"
    path.write_text(qualisys(names, stamps))
    demos = uc.load(path, state=["LHand X", "LHand Y", "LHand Z"], time="Time" if stamps else None)
    np.testing.assert_allclose(demos.states, HAND)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    assert "LHand X, LHand Y, LHand Z in mm" in " ".join(demos.notes)
    assert uc.inspect(path).columns[2 if stamps else 0].unit == "mm"


def test_bodies_of_qualisys(tmp_path):
    head = "NO_OF_FRAMES\t30\nFREQUENCY\t10\nDATA_INCLUDED\t6D\nBODY_NAMES\tTool\tCup\n"
    head += "\t".join(f"{body} X\tY\tZ\tRoll\tPitch\tYaw" for body in ("Tool", "Cup")) + "\n"
    body = "".join("\t".join(map(str, (*x, 0, 0, 0, *(x + 1), 0, 0, i))) + "\n" for i, x in enumerate(HAND))
    (tmp_path / "a.tsv").write_text(head + body)
    demos = uc.load(tmp_path / "a.tsv", state=["Cup X", "Cup Y", "Cup Yaw"])
    np.testing.assert_allclose(demos.states[:, :2], HAND[:, :2] + 1)
    assert "Cup X, Cup Y in mm; Cup Yaw in deg" in " ".join(demos.notes)


def labview(columns):
    end = "***End_of_Header***\n"
    head = f"LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nX_Columns\t{columns}\n{end}\t\n"
    segment = f"Channels\t3\t\t\nSamples\t30\t30\t30\nY_Unit_Label\tmm\tmm\tmm\nDelta_X\t0.1\t0.1\t0.1\n{end}"
    segment += "X_Value\tpx\tpy\tpz\tComment\n"
    times = TIME if columns == "One" else [""] * 30
    segment += "".join("\t".join(map(str, (t, *x))) + "\n" for t, x in zip(times, HAND, strict=True))
    return head + segment, segment


@pytest.mark.parametrize("columns", ["One", "No"])
def test_labview(tmp_path, columns):
    path = tmp_path / "a.lvm"
    whole, segment = labview(columns)
    path.write_text(whole)
    chosen = {"state": ["px", "py", "pz"], "time": "X_Value" if columns == "One" else None}
    demos = uc.load(path, **chosen)
    np.testing.assert_allclose(demos.states, HAND)
    np.testing.assert_allclose(demos.time, TIME, atol=1e-9)
    path.write_text(whole + "\n" + segment)
    again = uc.load(path, **chosen)
    assert again.n_episodes == 2
    np.testing.assert_allclose(again.time, np.tile(TIME, 2), atol=1e-9)


def test_eulers_of_motive_are_degrees(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(motive().replace("Quaternion", "XYZ").replace(",1,", ",1.5,", 9))
    notes = " ".join(uc.load(path, state="RHand.RX", time="Time (Seconds)", drop="missing").notes)
    assert "Euler angles in the order XYZ" in notes
    assert "RHand.RX in deg" in notes


def test_more_names_than_columns(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(vicon().replace(",,LHand,,,RHand,,", ",,LHand,,,RHand,,,,,More"))
    np.testing.assert_allclose(uc.load(path, state="LHand").states, HAND)
