"""Parts of a file: sections of an export, sheets, files of an archive."""

import io
import json
import zipfile

import numpy as np
import pandas as pd
import pytest

import unconstrain as uc
from tests.recordings.inspection.test_inspecting import run_next, say
from unconstrain.errors import DataError

N = 60
TIME = np.arange(N) / 100
X = np.column_stack([1 + np.sin(TIME), np.cos(TIME), 5 - TIME])


def section(title, rate, owner, axes, unit, values, mark=",", per_frame=1):
    empty = mark * (len(axes) + 1)
    lines = [
        title,
        str(rate),
        f"{mark * 2}{owner}{mark * (len(axes) - 1)}",
        mark.join(["Frame", "Sub Frame", *axes]),
    ]
    lines.append(mark * 2 + mark.join([unit] * len(axes)))
    for i, row in enumerate(values):
        lines.append(mark.join([str(i // per_frame + 1), str(i % per_frame), *(f"{x:.5f}" for x in row)]))
    assert empty
    return "\n".join(lines) + "\n\n"


def vicon():
    return (
        section(
            "Devices", 1000, "Plate - Force", ["Fx", "Fy", "Fz"], "N", np.repeat(X, 10, axis=0), per_frame=10
        )
        + section("Segments", 100, "Hip", ["RX", "RY", "RZ"], "deg", X * 10)
        + section("Trajectories", 100, "Hand", ["X", "Y", "Z"], "mm", X * 1000)
    )


def workbook(path):
    with pd.ExcelWriter(path) as book:
        pd.DataFrame({"Project": ["Rate"], "wiping": [50]}).to_excel(book, sheet_name="Info", index=False)
        for number in (1, 2):
            frame = pd.DataFrame(X + number, columns=["x", "y", "z"]).assign(t=TIME)
            frame.to_excel(book, sheet_name=f"Run {number}", index=False)


def archive(path, **files):
    with zipfile.ZipFile(path, "w") as held:
        for name, content in files.items():
            held.writestr(f"log/{name}.csv", content)
        held.writestr("__MACOSX/._a.csv", "\0")


def csv(X):
    return pd.DataFrame(X, columns=["x", "y", "z"]).assign(t=TIME).to_csv(index=False)


def test_sections_of_vicon(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(vicon())
    demos = uc.load(path, state="Hand")
    np.testing.assert_allclose(demos.states, X * 1000, atol=1e-4)
    assert "of its parts 'Trajectories' is read; part= names another one, of 'Devices', 'Segments'" in str(
        demos.notes
    )
    assert "Hand.X, Hand.Y, Hand.Z in mm" in str(demos.notes)
    turned = uc.load(path, state="Hip", part="segments")
    np.testing.assert_allclose(turned.states, X * 10, atol=1e-4)
    assert "in deg" in str(turned.notes)
    assert "part=" not in str(turned.notes)
    forces = uc.load(path, state="Plate - Force", part="Devices", window=0.01)
    np.testing.assert_allclose(forces.time, np.arange(10 * N) / 1000)
    with pytest.raises(
        DataError, match="no part 'Markers'; its parts are 'Devices', 'Segments', 'Trajectories'"
    ):
        uc.load(path, state="Hand", part="Markers")
    found = uc.inspect(path)
    assert [(column.kind, column.unit) for column in found.columns[2:5]] == [("position", "mm")] * 3
    assert "--part" not in found.next


def test_sheets(tmp_path):
    pytest.importorskip("openpyxl")
    workbook(tmp_path / "a.xlsx")
    demos = uc.load(tmp_path / "a.xlsx", state=["x", "y", "z"], time="t")
    np.testing.assert_allclose(demos.states, X + 1)
    assert "of its parts 'Run 1' is read; part= names another one, of 'Info', 'Run 2'" in demos.notes[0]
    second = uc.load(tmp_path / "a.xlsx", state=["x", "y", "z"], time="t", part="Run 2")
    np.testing.assert_allclose(second.states, X + 2)
    code, said = say("inspect", tmp_path / "a.xlsx", "--part", "Run 2", "--json")
    assert code == 0
    assert "--part 'Run 2'" in json.loads(said)["next"]
    code, said = run_next(uc.inspect(tmp_path / "a.xlsx", part="Run 2"), tmp_path)
    assert code == 0, said


def test_a_sheet_that_holds_a_movement_is_found(tmp_path):
    pytest.importorskip("openpyxl")
    with pd.ExcelWriter(tmp_path / "a.xlsx") as book:
        pd.DataFrame({"name": ["a"] * 99}).to_excel(book, sheet_name="Names", index=False)
        pd.DataFrame(X, columns=["x", "y", "z"]).assign(t=TIME).to_excel(book, sheet_name="Hand", index=False)
    found = uc.inspect(tmp_path / "a.xlsx")
    assert "--part Hand" in found.next
    assert "part 'Hand' holds a movement; --part chooses another one, of 'Names', 'Hand'" in found.notes
    code, said = run_next(found, tmp_path)
    assert code == 0, said


def test_the_rate_stands_in_another_sheet(tmp_path):
    pytest.importorskip("openpyxl")
    with pd.ExcelWriter(tmp_path / "a.xlsx") as book:
        pd.DataFrame({"Suit": ["Frame Rate"], "A": [60]}).to_excel(book, sheet_name="Info", index=False)
        frame = pd.DataFrame(X, columns=["x", "y", "z"])
        frame.insert(0, "Frame", np.arange(N) + 7)
        frame.to_excel(book, sheet_name="Hand", index=False)
    demos = uc.load(tmp_path / "a.xlsx", state=["x", "y", "z"])
    np.testing.assert_allclose(demos.time, np.arange(N) / 60)
    assert "time is made of Frame and the rate of the header, 60 Hz" in str(demos.notes)


def test_archives(tmp_path):
    path = tmp_path / "a.zip"
    archive(path, a=csv(X))
    demos = uc.load(path, state=["x", "y", "z"], time="t")
    np.testing.assert_allclose(demos.states, X)
    assert not any("part=" in note for note in demos.notes)
    archive(path, a=csv(X), b=csv(X[:50].repeat(2, axis=0)[:60] + 1))
    assert "part= names another one" in uc.load(path, state=["x", "y", "z"], time="t").notes[0]
    chosen = uc.load(path, state=["x", "y", "z"], time="t", part="a.csv")
    np.testing.assert_allclose(chosen.states, X)
    with zipfile.ZipFile(path, "w") as held:
        held.writestr("a.mat", b"MATLAB 5.0")
    with pytest.raises(DataError, match=r"holds a.mat, which is no text: unpack it"):
        uc.load(path, state="x", time="t")


def test_xz(tmp_path):
    import lzma

    packed = lzma.compress(csv(X).encode())
    (tmp_path / "a.csv.xz").write_bytes(packed)
    np.testing.assert_allclose(uc.load(tmp_path / "a.csv.xz", state=["x", "y", "z"], time="t").states, X)
    (tmp_path / "a.csv.xz").write_bytes(packed[:100])
    with pytest.raises(DataError, match=r"a.csv.xz (is damaged|cannot)"):
        uc.load(tmp_path / "a.csv.xz", state="x", time="t")


def test_what_has_no_parts(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(csv(X))
    with pytest.raises(DataError, match="has no parts of which part= could name one: leave it out"):
        uc.load(path, state="x", time="t", part="b")
    import tarfile

    content = io.BytesIO()
    with tarfile.open(fileobj=content, mode="w") as held:
        held.add(path, "a.csv")
    (tmp_path / "a.tar").write_bytes(content.getvalue())
    with pytest.raises(DataError, match=r"suffix '.tar'|is an archive of several files: unpack it"):
        uc.load(tmp_path / "a.tar", state="x", time="t")
