from tests.cli.commands import COLUMNS


def test_what_to_record_next_is_said_and_drawn(run, movements, tmp_path):
    code, out, err = run(
        "diagnose",
        movements,
        *COLUMNS,
        "--model",
        "linear",
        "--risk",
        "inconsistency",
        "-k",
        1,
        "--figure",
        "k.svg",
    )
    assert code == 0, err
    assert "determined: " in out
    assert (tmp_path / "k.svg").exists()
    code, _, err = run("diagnose", movements, *COLUMNS, "--model", "auto")
    assert code == 2
    assert "choose --model linear, rbf or locally-linear" in err
