"""Every stage on tiny recordings, twice: the second run must answer from the cache.

``make smoke`` runs this file; pytest does not.
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

CONFIG = Path(__file__).parents[1] / "configs" / "smoke.yaml"


def run(out: Path) -> str:
    """Text on the screen of ``hwid run``."""
    command = [sys.executable, "-m", "hwid_cli", "run", str(CONFIG), "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(
            f"hwid run ended with {done.returncode}:\n{done.stdout}{done.stderr}"
        )
    return done.stderr + done.stdout


def read_tensor(out: Path):
    """RMSD tensor, and the shape that its axes promise."""
    import h5py

    with h5py.File(out / "results.h5") as file:
        group = file["crossval"]
        axes = ("identified_on", "nb", "nk", "validated_on")
        return group["rmsd"][()], tuple(group[axis].shape[0] for axis in axes)


def check(holds: bool, message: str) -> None:
    """Stop with a message unless something holds."""
    if not holds:
        raise SystemExit(f"smoke: {message}")


def main() -> None:
    """Run twice and compare."""
    import numpy as np

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "smoke"
        first = run(out)
        tensor, shape = read_tensor(out)
        check(tensor.shape == shape, f"tensor {tensor.shape}, axes {shape}")
        check(bool(np.isfinite(tensor).all()), f"RMSDs that are not finite: {tensor}")
        second = run(out)
        for stage in ("identify", "crossval", "group", "test"):
            found = re.search(rf"^{stage}: (\d+) .* from the cache, 0 ", second, re.M)
            check(found is not None, f"{stage} was not cached:\n{second}")
        found = re.search(r"^diagnose: \d+ recordings from the cache", second, re.M)
        check(found is not None, f"diagnose was not cached:\n{second}")
        diagnosis = json.loads((out / "diagnosis.json").read_text(encoding="utf-8"))
        check(bool(diagnosis["summary"]), "the diagnosis says nothing")
        again, _ = read_tensor(out)
        check(bool(np.array_equal(tensor, again)), "the second run gave other numbers")
        page = (out / "report.html").read_text(encoding="utf-8")
        advice = (out / "order.csv").read_text(encoding="utf-8")
        check("all recordings" in advice, "no orders are recommended")
        check(
            "<h2" in page and page.count('<figure class="chart') > 5,
            "the report is empty",
        )
    sys.stdout.write(first)
    sys.stdout.write(f"smoke: passed, {tensor.size} RMSDs, cached in the second run\n")


if __name__ == "__main__":
    main()
