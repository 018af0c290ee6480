"""Files that are whole, or not there, and that one command at a time writes."""

import subprocess
import sys

import pytest

from asperity.files import TakenError, atomically, locked


def contents(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_whole_or_not_there(tmp_path):
    (tmp_path / "old.png").write_text("old")
    for name in ("old.png", "new.png"):
        with pytest.raises(KeyboardInterrupt), atomically(tmp_path / name) as part:
            part.write_text("half")
            raise KeyboardInterrupt
    assert contents(tmp_path) == {"old.png": "old"}
    with atomically(tmp_path / "old.png") as part:
        assert part.suffix == ".png"  # writers choose the format by it
        part.write_text("new")
    assert contents(tmp_path) == {"old.png": "new"}


@pytest.mark.parametrize("there", [True, False])
def test_links_and_permissions_stay(tmp_path, there):
    (tmp_path / "disk").mkdir()
    target, link = tmp_path / "disk" / "a.txt", tmp_path / "link.txt"
    link.symlink_to("disk/a.txt")
    if there:
        target.write_text("old")
        target.chmod(0o640)
    with atomically(link) as part:
        part.write_text("new")
    assert link.is_symlink() and contents(target.parent) == {"a.txt": "new"}
    assert not there or target.stat().st_mode & 0o777 == 0o640


def test_one_writer_at_a_time(tmp_path):
    path, link = tmp_path / "a.txt", tmp_path / "link.txt"
    link.symlink_to(path)
    for _ in range(2):
        with locked(path):
            for name in (path, link):
                with pytest.raises(TakenError, match=f"{name.name}: another asperity"), locked(name):
                    pass
            with locked(tmp_path / "b.txt"):
                pass
    assert list(tmp_path.iterdir()) == [link]


def test_a_killed_process_locks_nothing(tmp_path):
    code = "import sys, time, pathlib; from asperity.files import locked\nwith locked(pathlib.Path(sys.argv[1])): "
    code += "print(1, flush=True); time.sleep(60)"
    path = tmp_path / "a.txt"
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        with pytest.raises(TakenError), locked(path):
            pass
        other.kill()
        other.wait()
    assert [p.name for p in tmp_path.iterdir()] == [".a.txt.lock"]
    with locked(path):
        pass
    assert not list(tmp_path.iterdir())


def test_a_file_system_without_locks(tmp_path, monkeypatch):
    """Some of clusters have none: then nobody is kept out, but one can work."""
    fcntl = pytest.importorskip("fcntl")

    def refuse(*_):
        raise OSError(38, "Function not implemented")

    monkeypatch.setattr(fcntl, "flock", refuse)
    with locked(tmp_path / "a.txt"):
        pass
    assert not list(tmp_path.iterdir())
