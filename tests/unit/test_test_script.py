"""scripts/test.sh sums up its groups truly, and leaves out only what cannot have changed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def close(*rows: tuple[str, str, str, str], seconds: int = 100) -> tuple[int, list[str]]:
    """Return the exit code and the lines that the script ends with."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "closing_line.py"), str(seconds)],
        input="".join("\t".join(row) + "\n" for row in rows),
        capture_output=True,
        text=True,
        check=False,
    )
    assert not done.stderr
    return done.returncode, done.stdout.splitlines()


def test_last_line_is_pytests_closing_line_for_all_groups() -> None:
    code, lines = close(
        ("2", "0", "lint", "All checks passed!"),
        ("167", "0", "units", "11336 passed, 1 skipped, 6 warnings in 167.41s (0:02:47)"),
        (
            "117",
            "0",
            "Qt 5",
            "1181 passed, 18 skipped, 90 deselected, 1 warning, 2 rerun in 9.00s",
        ),
        ("-", "0", "RViz", "not run: unchanged since 0123456789ab"),
        seconds=561,
    )
    assert code == 0
    assert lines[-1] == (
        "12517 passed, 19 skipped, 90 deselected, 7 warnings, 2 rerun in 561.00s (0:09:21)"
    )
    assert any("RViz: not run: unchanged" in line for line in lines)
    assert not any("RViz" in line and "passed" in line for line in lines)


@pytest.mark.parametrize(
    ("code", "last", "closing"),
    [
        ("1", "2 failed, 7 passed, 1 error in 1.00s", "2 failed, 10 passed, 1 error in 9.00s"),
        # A check without tests, a crash, and a group in which no test was found.
        ("1", "Found 3 errors.", "3 passed, 1 error in 9.00s"),
        ("139", "", "3 passed, 1 error in 9.00s"),
        ("5", "no tests ran in 0.10s", "3 passed, 1 error in 9.00s"),
        # pytest's own errors follow a line that reports no failure.
        ("3", "7 passed in 1.00s", "10 passed, 1 error in 9.00s"),
    ],
)  # fmt: skip
def test_group_that_failed_fails_all(code: str, last: str, closing: str) -> None:
    exit_code, lines = close(
        ("1", code, "first", last), ("1", "0", "second", "3 passed in 1.00s"), seconds=9
    )
    assert exit_code == 1
    assert lines[-1] == closing
    assert any("first: FAILED" in line for line in lines)


class Checkout:
    """A clone with a file that counts and one that does not."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        upstream = folder / "upstream"
        self.git("init", "-q", "-b", "main", str(upstream), at=folder)
        for name in ("counts", "other"):
            (upstream / name).write_text("first")
        self.git("add", ".", at=upstream)
        self.git("commit", "-q", "-m", "first", at=upstream)
        self.clone = folder / "clone"
        self.git("clone", "-q", str(upstream), str(self.clone), at=folder)

    def git(self, *arguments: str, at: Path | None = None) -> None:
        who = ["-c", "user.name=test", "-c", "user.email=test@localhost"]
        subprocess.run(["git", *who, *arguments], cwd=at or self.clone, check=True)

    def commit(self, name: str) -> None:
        (self.clone / name).write_text("changed")
        self.git("commit", "-q", "-a", "-m", f"change {name}")

    def is_unchanged(self, base: str = "") -> bool:
        done = subprocess.run(
            [str(ROOT / "scripts" / "unchanged.sh"), "counts"],
            cwd=self.clone,
            env=os.environ | {"BASE": base},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.stdout.startswith("unchanged since ") == (done.returncode == 0)
        return done.returncode == 0


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Checkout:
    for name in [name for name in os.environ if name.startswith("GIT_")]:
        monkeypatch.delenv(name)
    return Checkout(tmp_path)


def test_branch_is_compared_with_where_it_left_main(checkout: Checkout) -> None:
    checkout.commit("other")
    assert checkout.is_unchanged()
    (checkout.clone / "counts").write_text("not committed")
    assert not checkout.is_unchanged()
    checkout.commit("counts")
    assert not checkout.is_unchanged()
    assert checkout.is_unchanged("HEAD")
    assert not checkout.is_unchanged("no-such-commit")


def test_new_file_is_a_change(checkout: Checkout) -> None:
    checkout.commit("other")
    checkout.git("rm", "-q", "--cached", "counts")
    assert not checkout.is_unchanged()


def test_tip_of_main_is_compared_where_it_is_a_merge(checkout: Checkout) -> None:
    assert not checkout.is_unchanged(), "which commits were pushed together is not known"
    checkout.git("checkout", "-q", "-b", "branch")
    checkout.commit("other")
    checkout.git("checkout", "-q", "main")
    checkout.git("merge", "-q", "--no-ff", "-m", "merge", "branch")
    checkout.git("update-ref", "refs/remotes/origin/main", "HEAD")
    assert checkout.is_unchanged()


def test_nothing_is_unchanged_where_there_is_nothing_to_compare_with(checkout: Checkout) -> None:
    checkout.commit("other")
    checkout.git("update-ref", "-d", "refs/remotes/origin/main")
    checkout.git("remote", "remove", "origin")
    assert not checkout.is_unchanged()
