import shlex

import unconstrain as uc
from unconstrain import demo


def test_demo_ends_with_a_command_that_works_twice(run, tmp_path):
    folder = tmp_path / "a [demo] of mine"
    code, out, _ = run("demo", "--out", folder.name)
    assert code == 0
    assert {p.name for p in folder.iterdir()} == {
        "limit-cycle.png",
        "table.md",
        "movements.csv",
        "others.csv",
    }
    last = shlex.split(out.strip().splitlines()[-1])
    assert last[0] == "unconstrain"
    for _ in range(2):
        code, out, err = run(*last[1:])
        assert code == 0, err
    _, test = demo.draw_recordings(0)
    shown = dict(line.split(" | ")[:2] for line in (folder / "table.md").read_text().splitlines()[2:])
    (told,) = (float(error) for name, error in shown.items() if "adaptive" in name)
    from_file = demo.measure_errors(uc.load_policy(folder / "policy.skops"), test)["nUPE"]
    assert told / 1.5 < from_file < 1.5 * told < 1e-3
    code, _, err = run("demo", "--out", folder.name)
    assert code == 2
    assert "limit-cycle.png exists: give --overwrite" in err


def test_a_folder_that_cannot_be_made_is_a_mistake(run, tmp_path):
    (tmp_path / "taken").write_text("")
    code, _, err = run("demo", "--out", "taken")
    assert code == 2
    assert "cannot make the folder taken" in err


def test_the_folder_of_nobody_is_not_made(run, tmp_path):
    code, _, said = run("demo", "--out", "~nobody-of-that-name/demo")
    assert (code, list(tmp_path.iterdir())) == (2, [])
    assert said.startswith("error:")
