"""The command line as a person calls it."""

from __future__ import annotations

import signal

import pytest

from er3a.pipeline.cli import main


def test_check_says_what_a_file_is(call):
    done = call("check", "data/robots/er3_600.yaml", "data/manual_refs/er3_600/axes.csv")
    assert done.returncode == 0
    assert "data/robots/er3_600.yaml: a robot, in order" in done.stdout


def test_check_names_every_bad_file_and_goes_on(call, tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("kind: robot\nname: bad\n")
    done = call("check", bad, "data/robots/er3_600.yaml", tmp_path / "none.yaml")
    assert done.returncode == 2
    assert done.stderr.count("error: ") == done.stderr.count("\n") == 2
    assert "a robot, in order" in done.stdout


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("compute", "validation", "er3_60"), "robots.er3_60: the study has no such robot"),
        (("compute", "validtion", "er3_600"), "there is no stage 'validtion'"),
        (("compute", "inverse", "er3_600", "--study", "nowhere.yaml"), "nowhere.yaml: there is no such file"),
        (("views", "er3_600", "validtion"), "there is no stage 'validtion'"),
        (("view", "nobody"), "no recordings below reports/nobody"),
    ],
)
def test_a_wrong_call_is_one_line_and_exit_code_2(call, words, told):
    done = call(*words)
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        (MemoryError("Unable to allocate 9 GiB"), "out of memory in `er3a "),
        (ImportError("numpy.so: failed to map segment from shared object"), "out of memory in `er3a "),
        (PermissionError(13, "Permission denied", "reports/x"), "reports/x: Permission denied"),
    ],
)
def test_a_machine_at_its_limits_is_one_line_and_exit_code_2(monkeypatch, capsys, fault, told):
    def fail(**_):
        raise fault

    monkeypatch.setattr("er3a.pipeline.cli.app", fail)
    with pytest.raises(SystemExit) as caught:
        main()
    error = capsys.readouterr().err
    assert caught.value.code == 2
    assert error.startswith(f"error: {told}")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        ("verdicts --fail-on never", "Invalid value for '--fail-on': 'never' is not one of 'caution', 'fail'"),
        ("run --fail-on maybe", "'maybe' is not one of 'caution', 'fail'"),
        ("verdicts --bogus", "No such option: --bogus"),
        ("chek", "No such command 'chek'"),
        ("compute validation", "Missing argument"),
        ("program write x --language perl --robot er3_600", "'perl' is not one of 'krl'"),
        ("import-urdf x --output", "requires an argument"),
        ("run -- --cores two", "number of cores"),
        ("run -- --bogus", "unrecognized arguments: --bogus"),
        ("run -- --cores", "expected one argument"),
        ("run --cores 0", "--cores is 0; a run needs 1 or more"),
        ("run -j -1", "--jobs is -1"),
    ],
)
def test_a_wrong_option_is_one_line_and_exit_code_2(monkeypatch, capsys, tmp_path, words, problem):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["er3a", *words.split()])
    with pytest.raises(SystemExit) as caught:
        main()
    told = capsys.readouterr()
    assert (caught.value.code, told.out) == (2, "")
    assert told.err.startswith("error: ")
    assert told.err.count("\n") == 1
    assert problem in told.err
    assert not list(tmp_path.iterdir())


@pytest.fixture(autouse=True)
def _own_sigterm():
    """What SIGTERM does in the test's process is as before."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.long
def test_urdf_out_and_in(call, tmp_path):
    urdf, robot = tmp_path / "arm.urdf", tmp_path / "arm.yaml"
    assert call("export-urdf", "er3_600", "--output", urdf).returncode == 0
    done = call("import-urdf", urdf, "--output", robot)
    assert "differs from the URDF by at most" in done.stdout
    assert call("check", robot).returncode == 0
