"""Folders of measurements as laboratories leave them, of a small first-order plant."""

import h5py
import numpy as np
import scipy.io

STEP_S = 0.002
N = 300


def inputs():
    """Steps after a rest, and a noise that holds its levels."""
    rng = np.random.default_rng(7)
    time = np.arange(N)
    found = {
        f"Sprung_{number}": size * (time >= 60)
        for number, size in enumerate((1.0, -2.0, 1.5, 0.7, 2.5))
    }
    found["Rauschen_1"] = np.repeat(rng.uniform(-2, 2, N // 10), 10)
    return {name: np.asarray(values, dtype=float) for name, values in found.items()}


def answer(u, *, seed=1):
    """What the plant does: a bent input, a lag, a little noise."""
    y = np.zeros(u.size)
    for k in range(1, u.size):
        y[k] = 0.9 * y[k - 1] + 0.1 * np.tanh(u[k - 1])
    return y + 1e-3 * np.random.default_rng(seed).standard_normal(u.size)


def measurements():
    """Time, input and output by name."""
    time = STEP_S * np.arange(N)
    return {name: (time, u, answer(u)) for name, u in inputs().items()}


def write_german_csv(folder):
    """Semicolons, decimal commas, units in brackets, millimetres, a counter in front."""
    for name, (time, u, y) in measurements().items():
        rows = ["Nr;Zeit [s];Motorstrom [A];Weg [mm];Temperatur [K]"]
        rows += [
            f"{k};{t:.4f};{a:.12f};{1e3 * b:.12f};293,15".replace(".", ",")
            for k, (t, a, b) in enumerate(zip(time, u, y, strict=True))
        ]
        (folder / f"{name}.csv").write_text("\n".join(rows), encoding="latin-1")
    (folder / ".versteckt.csv").write_text("nichts")
    (folder / "~$Sprung_1.csv").write_text("lock")
    (folder / "notes.txt").write_text("by hand")


def write_english_csv(folder):
    """Commas, units behind underscores, milliseconds."""
    for name, (time, u, y) in measurements().items():
        rows = ["time_ms,current_A,position_m,position_ref_m"]
        rows += [
            f"{1e3 * t:.3f},{a},{b},{0.5 * a}"
            for t, a, b in zip(time, u, y, strict=True)
        ]
        path = (
            folder
            / f"{name.replace('Sprung', 'step').replace('Rauschen', 'noise')}.csv"
        )
        path.write_text("\n".join(rows))


def write_bare_csv(folder):
    """No header, no time: output first."""
    for number, (_, u, y) in enumerate(measurements().values()):
        rows = [f"{b}\t{a}" for a, b in zip(u, y, strict=True)]
        (folder / f"run{number}.csv").write_text("\n".join(rows))


def write_mat_variables(folder):
    """A variable each, with settings among them."""
    for name, (time, u, y) in measurements().items():
        content = {"t": time, "u": u, "y": y, "kp": 160.0, "about": "a text"}
        scipy.io.savemat(folder / f"{name}.mat", content)


def write_mat_matrix(folder):
    """One table of unnamed columns, with settings beside it."""
    for name, (time, u, y) in measurements().items():
        table = np.column_stack([time, np.zeros(N), u, y])
        scipy.io.savemat(folder / f"{name}.mat", {"data": table, "J": 0.3})


def write_mat_struct(folder):
    """A struct with members."""
    for name, (time, u, y) in measurements().items():
        inside = {"time": time, "input": u, "output": y}
        scipy.io.savemat(folder / f"{name}.mat", {"data": inside})


def write_npz(folder):
    """Arrays and a rate."""
    for name, (_, u, y) in measurements().items():
        np.savez(folder / f"{name}.npz", u=u, y=y, fs=1.0 / STEP_S)


def write_h5(folder):
    """Groups."""
    for name, (time, u, y) in measurements().items():
        with h5py.File(folder / f"{name}.h5", "w") as file:
            for key, values in (("time", time), ("current", u), ("position", y)):
                file[f"measured/{key}"] = values


LAYOUTS = {
    "german csv": write_german_csv,
    "english csv": write_english_csv,
    "bare csv": write_bare_csv,
    "mat variables": write_mat_variables,
    "mat matrix": write_mat_matrix,
    "mat struct": write_mat_struct,
    "npz": write_npz,
    "h5": write_h5,
}
# Time, input, output, and their units that must be found; None where nothing says one.
EXPECTED = {
    "german csv": ("Zeit [s]", "Motorstrom [A]", "Weg [mm]", "s", "A", "mm"),
    "english csv": ("time_ms", "current_A", "position_m", "ms", "A", "m"),
    "bare csv": (None, 1, 0, None, None, None),
    "mat variables": ("t", "u", "y", None, None, None),
    "mat matrix": (0, 2, 3, None, None, None),
    "mat struct": ("data.time", "data.input", "data.output", None, None, None),
    "npz": (None, "u", "y", None, None, None),
    "h5": (
        *("measured/time", "measured/current", "measured/position"),
        *(None, None, None),
    ),
}
