"""Layouts on disk: saved whole, merged with changes from outside, recovered after a crash."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosglass.cockpit import layout_file
from rosglass.cockpit.layout_file import Conflict, LayoutFile, Recovery, merge
from rosglass.errors import QmlError

if TYPE_CHECKING:
    from pathlib import Path

TEXT = "Item {\n    a: 1\n\n    b: 2\n\n    c: 3\n}\n"


@pytest.fixture
def file(tmp_path: Path) -> LayoutFile:
    return LayoutFile.create(tmp_path / "drive.qml", TEXT)


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


class TestSaving:
    def test_bytes_stay(self, tmp_path: Path) -> None:
        path = tmp_path / "a.qml"
        data = "\ufeffItem {\r\n\ta: 'ä'\n}".encode()
        path.write_bytes(data)
        file = LayoutFile.open(path)
        file.save(file.text)
        assert path.read_bytes() == data

    def test_mode_and_link_stay_and_nothing_is_left_behind(self, tmp_path: Path) -> None:
        folder = tmp_path / "real"
        folder.mkdir()
        target, link = folder / "a.qml", tmp_path / "a.qml"
        target.write_text(TEXT)
        target.chmod(0o640)
        link.symlink_to(target)
        LayoutFile.open(link).save("Item {}")
        assert link.is_symlink()
        assert target.read_text() == "Item {}"
        assert stat.S_IMODE(target.stat().st_mode) == 0o640
        assert [path.name for path in folder.iterdir()] == ["a.qml"]

    def test_new_file_has_the_usual_mode(self, file: LayoutFile, tmp_path: Path) -> None:
        usual = tmp_path / "usual"
        usual.touch()
        assert file.path.stat().st_mode == usual.stat().st_mode

    def test_failed_save_leaves_the_file(
        self, file: LayoutFile, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def full(_: int) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        with pytest.raises(QmlError, match=r"drive.qml cannot be saved: No space left on device"):
            file.save("Item {}")
        assert file.path.read_text() == file.text == TEXT
        assert len(list(file.path.parent.iterdir())) == 1

    def test_killed_while_saving_leaves_the_file(self, file: LayoutFile) -> None:
        code = (
            "import os, signal, sys\n"
            "from rosglass.cockpit.layout_file import LayoutFile\n"
            "os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)\n"
            "LayoutFile.open(sys.argv[1]).save('Item {}')"
        )
        done = subprocess.run([sys.executable, "-c", code, str(file.path)], check=False)
        assert done.returncode == -9
        assert file.path.read_text() == TEXT

    @pytest.mark.skipif(os.getuid() == 0, reason="root may write to any file")
    def test_read_only_file_is_not_replaced(self, file: LayoutFile) -> None:
        file.path.chmod(0o444)
        with pytest.raises(QmlError, match="read-only"):
            file.save("Item {}")

    def test_files_that_are_not_layouts(self, tmp_path: Path) -> None:
        with pytest.raises(QmlError, match=r"none.qml cannot be read: No such file"):
            LayoutFile.open(tmp_path / "none.qml")
        with pytest.raises(QmlError, match="not a file"):
            LayoutFile.open(tmp_path)
        fifo, large, other = tmp_path / "fifo", tmp_path / "large", tmp_path / "latin1.qml"
        os.mkfifo(fifo)
        with pytest.raises(QmlError, match="not a file"):
            LayoutFile.open(fifo)
        with pytest.raises(QmlError, match="not a file"):
            LayoutFile.create(fifo, TEXT)
        with large.open("wb") as sparse:
            sparse.truncate(1 << 40)
        with pytest.raises(QmlError, match="not a layout"):
            LayoutFile.open(large)
        other.write_bytes(b"Item {\n a: '\xe4' }")
        with pytest.raises(QmlError, match=r"latin1.qml:2: not UTF-8"):
            LayoutFile.open(other)
        with pytest.raises(QmlError, match=r"half.qml:2: half of a character"):
            LayoutFile.create(tmp_path / "half.qml", "Item {\n a: '\ud800' }")
        with pytest.raises(QmlError, match=r"cannot be saved: No such file"):
            LayoutFile.create(tmp_path / "none" / "a.qml", TEXT)


class TestChangesFromOutside:
    def test_only_other_texts_count(self, file: LayoutFile) -> None:
        assert not file.changed_outside()
        os.utime(file.path, (1, 1))
        assert not file.changed_outside()
        file.path.write_text(TEXT.replace("1", "9"))  # the same size
        os.utime(file.path, (1, 1))
        assert file.changed_outside()
        assert file.changed_outside()
        with pytest.raises(QmlError, match="changed by another program and is not overwritten"):
            file.save("Item {}")
        file.accept(file.reread())
        assert not file.changed_outside()
        file.save("Item {}")
        assert not file.changed_outside()
        assert file.path.read_text() == "Item {}"

    def test_replaced_and_missing_files(self, file: LayoutFile) -> None:
        other = file.path.with_name("other")
        other.write_text("Item { }")
        other.replace(file.path)
        assert file.changed_outside()
        file.path.unlink()
        assert not file.changed_outside()
        with pytest.raises(QmlError, match="cannot be read"):
            file.reread()
        file.save(TEXT)
        assert file.path.read_text() == TEXT
        file.path.write_bytes(b"\xff")
        assert file.changed_outside()

    def test_changes_of_both_sides_are_merged(self, file: LayoutFile) -> None:
        file.path.write_text(TEXT.replace("c: 3", "c: 4").replace("a: 1\n", "a: 1 // theirs\n"))
        mine = TEXT.replace("b: 2", "b: 3")
        merged, conflicts = file.merge(mine)
        assert not conflicts
        assert merged == "Item {\n    a: 1 // theirs\n\n    b: 3\n\n    c: 4\n}\n"

    def test_conflicts_are_reported(self) -> None:
        mine, theirs = TEXT.replace("b: 2", "b: 3"), TEXT.replace("b: 2", "b: 4")
        assert merge(TEXT, mine, theirs) == (
            mine,
            [Conflict(4, "both have changed it", "    b: 2\n", "    b: 3\n", "    b: 4\n")],
        )
        assert merge(TEXT, mine, mine) == (mine, [])
        assert merge(TEXT, TEXT, theirs) == (theirs, [])
        # Line numbers are one's own.
        mine = TEXT.replace("Item {\n", "Item {\n    new: 1\n").replace("b: 2", "b: 3")
        assert [found.line for found in merge(TEXT, mine, theirs)[1]] == [5]

    def test_conflicts_that_lines_do_not_show(self) -> None:
        mine, theirs = TEXT.replace("a: 1", "a: 1; d: 1"), TEXT.replace("c: 3", "c: 3; d: 2")
        assert merge(TEXT, mine, theirs)[1] == [Conflict(1, "d of Item would be there twice")]
        base = "A {\n    B {\n    }\n\n    C {\n    }\n}\n"
        mine, theirs = base.replace("B {", "B { id: x"), base.replace("C {", "C { id: x")
        assert merge(base, mine, theirs)[1] == [Conflict(1, "the id x would be there twice")]
        mine, theirs = TEXT.replace("a: 1", "a: 1 //"), TEXT.replace("c: 3", "c: 3 }")
        found = merge(TEXT, mine, theirs)
        assert found[0] == mine
        assert "is not QML: <text>:7:1: expected the end" in found[1][0].reason

    @settings(deadline=None)
    @given(
        base=st.lists(st.sampled_from(["", "a: 1", "b: 2", "C {}", "// d"]), max_size=12),
        own=st.lists(st.tuples(st.integers(0, 12), st.integers(0, 2)), max_size=3),
        other=st.lists(st.tuples(st.integers(0, 12), st.integers(0, 2)), max_size=3),
    )
    def test_merge_has_the_changes_of_both(
        self, base: list[str], own: list[tuple[int, int]], other: list[tuple[int, int]]
    ) -> None:
        def changed(changes: list[tuple[int, int]], new: str) -> str:
            lines = list(base)
            for number, (at, removed) in enumerate(changes):
                lines[at : at + removed] = [f"{new}{number} {{}}"]
            return "\n".join(["Item {", *lines, "}", ""])

        before, mine, theirs = changed([], ""), changed(own, "M"), changed(other, "T")
        text, conflicts = merge(before, mine, theirs)
        if conflicts:
            assert text == mine
            return
        for line in ("M0 {}", "M1 {}", "M2 {}", "T0 {}", "T1 {}", "T2 {}"):
            assert (line in text) == (line in mine or line in theirs)
        # Which side is one's own makes no difference.
        assert merge(before, theirs, mine) == (text, [])

    def test_git_merges_the_same(self, tmp_path: Path) -> None:
        lines = [f"    // line {number}\n" for number in range(60)]
        before = "".join(["Item {\n", *lines, "}\n"])
        mine = before.replace("line 3\n", "line 3\n    a: 1\n").replace("    // line 30\n", "")
        theirs = before.replace("line 50", "b").replace("    // line 10\n    // line 11\n", "")
        paths = [tmp_path / name for name in ("mine", "base", "theirs")]
        for path, text in zip(paths, (mine, before, theirs), strict=True):
            path.write_text(text)
        done = subprocess.run(
            ["git", "merge-file", "-p", *map(str, paths)], capture_output=True, check=True
        )
        assert merge(before, mine, theirs) == (done.stdout.decode(), [])

    @pytest.mark.timeout(60)  # hours, if all lines were compared
    def test_large_texts(self) -> None:
        base = "Item {\n" + "// a\n// b\n" * 200_000 + "}\n"
        mine, theirs = base.replace("a", "c"), base.replace("b", "d")
        text, conflicts = merge(base, mine, theirs)
        assert text == mine
        assert len(conflicts) == 1


class TestRecovery:
    def test_text_survives_a_crash(self, file: LayoutFile) -> None:
        code = (
            "import os, signal, sys\n"
            "from rosglass.cockpit.layout_file import Recovery\n"
            "Recovery.keep(sys.argv[1], 'Item {}')\n"
            "print('kept', flush=True)\n"
            "sys.stdin.read()"
        )
        crashed = subprocess.Popen(
            [sys.executable, "-c", code, str(file.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert crashed.stdout is not None
        assert crashed.stdout.readline() == b"kept\n"
        # While the other program runs, its text is not offered, nor dropped.
        assert Recovery.find(file.path) is None
        Recovery.drop(file.path)
        crashed.kill()
        crashed.communicate()
        assert Recovery.find(file.path) == "Item {}"
        assert Recovery.find(file.path.with_name("other.qml")) is None
        Recovery.drop(file.path)
        assert Recovery.find(file.path) is None

    def test_newest_text_is_found(self, tmp_path: Path) -> None:
        for text in ("a", "ä\ud800"):
            Recovery.keep(tmp_path / "new.qml", text)
        assert Recovery.find(tmp_path / "new.qml") == "ä\ud800"
        kept = list((tmp_path / "state" / "rosglass" / "cockpit" / "recovery").iterdir())
        assert [stat.S_IMODE(path.stat().st_mode) for path in kept] == [0o600]

    @pytest.mark.parametrize(
        "data", [b"", b"{", b"[]", b'{"text": 1, "pid": 1, "start": ""}', b"[" * 100_000, b"\xff"]
    )
    def test_damaged_entries_are_removed(self, file: LayoutFile, data: bytes) -> None:
        Recovery.keep(file.path, "Item {}")
        (kept,) = layout_file._recoveries(file.path)
        kept.write_bytes(data)
        assert Recovery.find(file.path) is None
        assert not kept.exists()
        kept.write_bytes(data)
        Recovery.drop(file.path)
        assert not kept.exists()

    def test_number_of_entries_is_limited(self, tmp_path: Path) -> None:
        for number in range(70):
            Recovery.keep(tmp_path / f"{number}.qml", "Item {}")
        folder = tmp_path / "state" / "rosglass" / "cockpit" / "recovery"
        assert len(list(folder.iterdir())) == 50
        assert Recovery.find(tmp_path / "69.qml") == "Item {}"

    def test_text_that_cannot_be_kept(self, file: LayoutFile, tmp_path: Path) -> None:
        (tmp_path / "state").write_text("a file")
        with pytest.raises(QmlError, match="cannot be written: Not a directory"):
            Recovery.keep(file.path, "Item {}")
        assert Recovery.find(file.path) is None
        Recovery.drop(file.path)
