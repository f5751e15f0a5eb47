"""Writes docs/scale.md from what ``bench_dask`` has measured: ``make scale``.

Usage: python docs/scale.py MEASURED.json > docs/scale.md (from the project's folder)
"""

import json
import sys
from pathlib import Path

import matplotlib.pyplot as plt

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hwid_cli.campaign.chunks import (
    CHUNK_S,
    CHUNKS_AHEAD,
    LEAST_CHUNK_S,
    MOST_IN_CHUNK,
)
from tests.benchmarks.cluster_model import Costs, Played, Round, grid_rounds, play

FIGURE = Path(__file__).with_name("figures") / "scale.png"
RECORDINGS, NB, NK = 1000, 40, 25
# Seconds of one core: docs/benchmarks.md, recordings of 7500 samples.
FIT_S, FIT_SPREAD, VALIDATION_S = 0.09, 0.35, 0.0013
WORKERS = (2, 10, 30, 100, 300, 1000)
LATENCY_S = 0.001


def chunk_of(seconds: float) -> int:
    """Tasks that go out together."""
    return max(1, min(int(CHUNK_S / seconds), MOST_IN_CHUNK))


def campaign() -> dict[str, tuple[Round, ...]]:
    """Rounds of both stages."""
    n_orders = NB * NK
    judged = n_orders * VALIDATION_S
    fits = grid_rounds(
        RECORDINGS, NB, NK, seconds=FIT_S, spread=FIT_SPREAD, chunk=chunk_of(FIT_S)
    )
    return {
        "identify": fits,
        "crossval": (Round(RECORDINGS**2, judged, 0.1, chunk_of(judged)),),
    }


def costs_of(measured: dict[str, float]) -> Costs:
    """What the way costs, from the measurement."""
    half = measured["parent_chunk_s"] / 2.0
    return Costs(
        half,
        half,
        measured["parent_result_s"],
        measured["scheduler_chunk_s"],
        LATENCY_S,
    )


def duration(seconds: float) -> str:
    """A time for people."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.1f} {unit}"
    return f"{seconds:.0f} s"


def drawn(played: dict[str, dict[int, Played]]) -> None:
    """Speed against workers for both stages."""
    figure, axes = plt.subplots(figsize=(6.0, 4.0), layout="constrained")
    axes.loglog(WORKERS, WORKERS, color="0.6", linestyle="--", label="no loss")
    for stage, rows in played.items():
        work = sum(one.tasks * one.seconds for one in campaign()[stage])
        speed = [work / rows[n].wall_s for n in WORKERS]
        axes.loglog(WORKERS, speed, marker="o", label=stage)
    axes.set_xlabel("workers of one thread [-]")
    axes.set_ylabel("speed against one core [-]")
    axes.legend(loc="upper left")
    axes.grid(True, which="both", alpha=0.3)
    figure.savefig(FIGURE, dpi=120)


def table(rows: dict[int, Played]) -> list[str]:
    """One stage as a table."""
    lines = [
        "| workers | wall | workers busy | parent busy | scheduler busy |",
        "|---|---|---|---|---|",
    ]
    for n, one in rows.items():
        lines.append(
            f"| {n} | {duration(one.wall_s)} | {one.workers_busy:.0%} | "
            f"{one.parent_busy:.0%} | {one.scheduler_busy:.0%} |"
        )
    return lines


def limit(stage: tuple[Round, ...], costs: Costs) -> float:
    """Workers that keep the parent busy all the time."""
    one = max(stage, key=lambda each: each.tasks)
    busy = costs.send_s + costs.receive_s + one.chunk * costs.write_s
    return one.chunk * one.seconds / busy


def document(measured: dict[str, float]) -> str:
    """The whole page."""
    costs, stages = costs_of(measured), campaign()
    played = {
        name: {n: play(rounds, n, costs, ahead=CHUNKS_AHEAD) for n in WORKERS}
        for name, rounds in stages.items()
    }
    drawn(played)
    share = measured["wall_chunk_s"] / CHUNK_S
    limits = {name: limit(rounds, costs) for name, rounds in stages.items()}
    work = {
        name: sum(one.tasks * one.seconds for one in rounds)
        for name, rounds in stages.items()
    }
    names = ("wall", "parent", "scheduler")
    way = "\n".join(
        f"| {name} | {measured[f'{name}_chunk_s'] * 1e3:.2f} | "
        f"{measured[f'{name}_result_s'] * 1e3:.2f} |"
        for name in names
    )
    text = Path(__file__).with_name("scale_template.md").read_text()
    return text.format(
        way=way,
        share=f"{share:.1%}",
        fits=int(measured["fits"]),
        ratio=f"{measured['dask_s'] / measured['local_s']:.3f}",
        packed=f"{measured['entry_bytes'] / 1e3:.0f}",
        chunk_s=CHUNK_S,
        least_s=LEAST_CHUNK_S,
        least_share=f"{measured['wall_chunk_s'] / LEAST_CHUNK_S:.1%}",
        most=MOST_IN_CHUNK,
        fit_chunk=stages["identify"][0].chunk,
        fit_ms=f"{FIT_S * 1e3:.0f}",
        validation_ms=f"{VALIDATION_S * 1e3:.1f}",
        identify="\n".join(table(played["identify"])),
        crossval="\n".join(table(played["crossval"])),
        identify_work=duration(work["identify"]),
        crossval_work=duration(work["crossval"]),
        identify_limit=f"{limits['identify']:.0f}",
        crossval_limit=f"{limits['crossval']:.0f}",
        records_gb=f"{RECORDINGS * NB * NK * measured['fit_bytes'] / 1e9:.0f}",
        cache_gb=f"{RECORDINGS * NB * NK * measured['entry_bytes'] / 1e9:.0f}",
        tensor_gb=f"{RECORDINGS**2 * NB * NK * 8 / 1e9:.0f}",
    )


if __name__ == "__main__":
    sys.stdout.write(document(json.loads(Path(sys.argv[1]).read_text())))
