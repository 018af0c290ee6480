"""Random descriptions of materials and damaged files, tried in child processes that are watched.

    python tests/fuzz/run.py --count 10000 --files 2000 --measured 50000 --seed 1

Nothing may crash, hang, accept what is flawed, give values that are not finite or negative, or complain obscurely.
What does is listed with the command that repeats it; the exit status is then 1.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import cycle
from pathlib import Path
from tempfile import TemporaryFile
from threading import Timer
from typing import NamedTuple

HERE = Path(__file__).parent
ROTATION = {"scalar_rgb": 200, "scalar_spectral": 200, "llvm_ad_rgb": 40, "llvm_ad_spectral": 40}
"""Variants in turn, and how many cases their children try; LLVM compiles for each of them."""
EACH = 5000
"""Files of measured BRDFs that a child tries."""
GOOD = ("fine", "refused")
START = 120
"""Seconds in which a child has imported everything and made its files."""


class Outcome(NamedTuple):
    """What became of a case."""

    kind: str
    variant: str
    seed: int
    index: int
    result: str
    what: str

    def __str__(self) -> str:
        repeat = f"{Path(__file__).name} --only {self.kind} {self.variant} {self.seed} {self.index}"
        return f"{self.result}\n  {self.what}\n  {repeat}"


def batch(kind: str, variant: str, seed: int, start: int, stop: int, patience: float) -> Iterator[Outcome]:
    """Outcomes of the cases from ``start`` to ``stop``; a child that dies or says nothing is followed by another."""
    while start < stop:
        command = [sys.executable, str(HERE / "worker.py"), kind, variant, str(seed), str(start), str(stop)]
        trying = what = None
        with TemporaryFile("w+") as errors:  # a pipe would fill
            child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)
            for line in watched(child, patience):
                told = json.loads(line)
                trying, what = told.get("trying"), told["what"]
                if trying is None:
                    yield Outcome(kind, variant, seed, told["index"], told["result"], what)
                    start = told["index"] + 1
            status = child.wait()
            errors.seek(0)
            last = errors.read().strip().splitlines()[-3:]
        if status == 0 and start >= stop:
            return
        if trying is None and start < stop:
            raise RuntimeError("\n".join(["the worker does not start:", *last]))
        index = stop - 1 if trying is None else trying  # it may also crash when it ends
        yield Outcome(kind, variant, seed, index, f"hung or crashed, status {status}: {' / '.join(last)}", what or "")
        start = index + 1


def watched(child: subprocess.Popen[str], patience: float) -> Iterator[str]:
    """The lines of a child, which is killed if it says nothing for so many seconds; more at first, when it imports."""
    assert child.stdout
    wait = max(patience, START)
    while True:
        watch = Timer(wait, child.kill)
        watch.start()
        line = child.stdout.readline()
        watch.cancel()
        if not line:
            return
        yield line
        wait = patience


def plan(kind: str, count: int) -> Iterator[tuple[str, str, int, int]]:
    """Batches of cases, by variant, start and stop."""
    start = 0
    for variant, size in cycle(ROTATION.items()):
        if start >= count:
            return
        yield kind, variant, start, min(start + size, count)
        start += size


def of_measured(count: int) -> Iterator[tuple[str, str, int, int]]:
    """The same for files of measured BRDFs, in a variant that reads them all."""
    for start in range(0, count, EACH):
        yield "measured", "llvm_ad_rgb", start, min(start + EACH, count)


def fuzz(count: int, files: int, measured: int, seed: int, jobs: int, patience: float) -> list[Outcome]:
    """All outcomes, in the order of the cases."""
    batches = [*plan("descriptions", count), *plan("files", files), *of_measured(measured)]
    with ThreadPoolExecutor(jobs) as pool:
        run = pool.map(lambda b: list(batch(b[0], b[1], seed, b[2], b[3], patience)), batches)
        return [outcome for outcomes in run for outcome in outcomes]


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="descriptions")
    parser.add_argument("--files", type=int, default=200, help="damaged files")
    parser.add_argument("--measured", type=int, default=400, help="damaged files of measured BRDFs")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="children at a time")
    parser.add_argument("--patience", type=float, default=60, help="seconds until a case hangs")
    parser.add_argument("--only", nargs=4, metavar=("KIND", "VARIANT", "SEED", "INDEX"), help="repeat one case")
    given = parser.parse_args()
    if given.only:
        kind, variant, seed, index = given.only
        outcomes = list(batch(kind, variant, int(seed), int(index), int(index) + 1, given.patience))
    else:
        outcomes = fuzz(given.count, given.files, given.measured, given.seed, given.jobs, given.patience)
    bad = [outcome for outcome in outcomes if outcome.result not in GOOD]
    print("\n".join(map(str, outcomes if given.only else bad)))
    print(Counter(outcome.result.split(":")[0] for outcome in outcomes))
    raise SystemExit(bool(bad))


if __name__ == "__main__":
    main()
