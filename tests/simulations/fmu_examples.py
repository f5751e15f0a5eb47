"""FMUs made here: a mass, a spring and a damper in C, and what can be wrong with one."""

import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

fmpy = pytest.importorskip(
    "fmpy", reason="FMPy is not installed: pip install 'hwid[fmu]'"
)

COMPILER = next((one for one in ("gcc", "cc", "clang") if shutil.which(one)), None)
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")

MASS_KG = 0.3
STARTS = {"damping": 15.0, "stiffness": 1184.0, "kt": 5.0}
# By value reference, from 1.
NAMES = (
    "current_A", "force_N", "displacement_m", "velocity_m_per_s", *STARTS, "start_m"
)  # fmt: skip

# Runge-Kutta of the fourth order; with friction in steps that stop the mass exactly.
_PLANT = """
#include <stdlib.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
typedef struct { double value[9]; void *log; void *where; bool log_is_3; } Unit;
static void begin(Unit *u) {
    memset(u->value, 0, sizeof u->value);
    u->value[5] = 15.0; u->value[6] = 1184.0; u->value[7] = 5.0;
}
static int accelerate(const double *s, double x, double v, double *a) {
    *a = (s[7] * s[1] + s[2] - s[5] * v - s[6] * x) / 0.3;
    return 0;
}
static void move(double *s, double h) {
    double x = s[3], v = s[4], a, b, c, d;
    double friction = COULOMB;
    if (friction > 0) {
        double free, limit = friction / 0.3 * h;
        accelerate(s, x, v, &a);
        free = v + h * a;
        v = free > limit ? free - limit : free < -limit ? free + limit : 0.0;
        s[3] = x + h * v; s[4] = v;
        return;
    }
    accelerate(s, x, v, &a);
    accelerate(s, x + h / 2 * v, v + h / 2 * a, &b);
    accelerate(s, x + h / 2 * (v + h / 2 * a), v + h / 2 * b, &c);
    accelerate(s, x + h * (v + h / 2 * b), v + h * c, &d);
    s[3] = x + h / 6 * (6 * v + h * (a + b + c));
    s[4] = v + h / 6 * (a + 2 * b + 2 * c + d);
}
static int step(Unit *u, double t, double h) {
    int n = (int)ceil(h / INTERNAL_STEP - 1e-9), i;
    for (i = 0; i < n; i++) move(u->value, h / n);
    FAULT
    return 0;
}
static int put(Unit *u, const uint32_t *refs, size_t n, const double *in) {
    size_t i;
    for (i = 0; i < n; i++) {
        u->value[refs[i]] = in[i];
        if (refs[i] == 8) u->value[3] = in[i];
    }
    return 0;
}
static int take(Unit *u, const uint32_t *refs, size_t n, double *out) {
    size_t i;
    for (i = 0; i < n; i++) out[i] = u->value[refs[i]];
    return 0;
}
"""
_FMI_2 = """
typedef struct {
    void (*log)(void *, const char *, int, const char *, const char *, ...);
    void *(*get)(size_t, size_t); void (*give)(void *); void *done; void *where;
} Callbacks;
static int say(Unit *u, const char *text) {
    ((Callbacks *)u->log)->log(u->where, "unit", 3, "error", "%s (of %d)", text, 9);
    return 3;
}
void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *place,
                      void *callbacks, int visible, int logging) {
    Unit *u = calloc(1, sizeof *u);
    u->log = callbacks; u->where = ((Callbacks *)callbacks)->where;
    begin(u); return u;
}
void fmi2FreeInstance(void *u) { free(u); }
int fmi2SetupExperiment(void *u, int d, double t, double s, int e, double f) { return 0; }
int fmi2EnterInitializationMode(void *u) { return 0; }
int fmi2ExitInitializationMode(void *u) { return 0; }
int fmi2Terminate(void *u) { return 0; }
int fmi2Reset(void *u) { RESET }
int fmi2SetReal(void *u, const uint32_t *r, size_t n, const double *x) { return put(u, r, n, x); }
int fmi2GetReal(void *u, const uint32_t *r, size_t n, double *x) { return take(u, r, n, x); }
int fmi2DoStep(void *u, double t, double h, int keep) { return step(u, t, h); }
"""
_FMI_3 = """
typedef void (*Log)(void *, int, const char *, const char *);
static int say(Unit *u, const char *text) {
    ((Log)u->log)(u->where, 3, "error", text);
    return 3;
}
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *place,
    bool visible, bool logging, bool events, bool early, const uint32_t *needed, size_t n,
    void *where, void *log, void *update) {
    Unit *u = calloc(1, sizeof *u);
    u->log = log; u->where = where;
    begin(u); return u;
}
void fmi3FreeInstance(void *u) { free(u); }
int fmi3EnterInitializationMode(void *u, bool d, double t, double s, bool e, double f) { return 0; }
int fmi3ExitInitializationMode(void *u) { return 0; }
int fmi3Terminate(void *u) { return 0; }
int fmi3Reset(void *u) { RESET }
int fmi3SetFloat64(void *u, const uint32_t *r, size_t n, const double *x, size_t m) { return put(u, r, n, x); }
int fmi3GetFloat64(void *u, const uint32_t *r, size_t n, double *x, size_t m) { return take(u, r, n, x); }
int fmi3DoStep(void *u, double t, double h, bool keep, bool *event, bool *end, bool *early, double *last) {
    *event = *end = *early = false; *last = t + h;
    END
    return step(u, t, h);
}
"""
# What may happen in a step.
FAULTS = {
    "nan": "if (t > 0.05) u->value[3] = NAN;",
    "error": "if (t > 0.0495 && t < 0.0505) return say(u, \"solver failed\");",
    "crash": "if (t > 0.05) *(volatile int *)0 = 1;",
    "hang": "while (t > 0.05) { if (u->value[3] == -1e9) break; }",
}  # fmt: skip


def make_fmu(
    folder: Path,
    version: int = 2,
    *,
    fault: str = "",
    coulomb_N: float = 0.0,
    reset: str = "begin(u); return 0;",
    change=lambda description: description,
    platform: str | None = None,
    name: str = "drive",
    internal_step_s: float = 1e-4,
    ends: bool = False,
) -> Path:
    """Write an FMU of the plant.

    Parameters
    ----------
    fault : str
        One of ``FAULTS``.
    change : callable
        From the text of modelDescription.xml to another one.
    platform : str or None
        Folder of the binary; None for this one.
    """
    words = {
        "FAULT": FAULTS.get(fault, ""),
        "COULOMB": repr(coulomb_N),
        "INTERNAL_STEP": repr(internal_step_s),
        "RESET": reset,
        "END": "*end = t > 0.05;" if ends else "",
    }
    head, calls = _PLANT, _FMI_2 if version == 2 else _FMI_3
    # ``say`` stands in the part that knows the standard.
    source = head.replace(
        "static int step", "static int say(Unit *, const char *);\nstatic int step"
    )
    source += calls
    for word, text in words.items():
        source = source.replace(word, text)
    here = fmpy.platform if version == 2 else fmpy.platform_tuple
    binary = _compiled(folder, name, source + _stubs(source, version))
    path = folder / f"{name}.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", change(description(version, name)))
        archive.write(binary, f"binaries/{platform or here}/{binary.name}")
    return path


def _stubs(source: str, version: int) -> str:
    """Functions that FMPy looks for and nobody calls."""
    from fmpy.fmi2 import FMU2Slave
    from fmpy.fmi3 import FMU3Slave

    kind = {2: FMU2Slave, 3: FMU3Slave}[version]
    names = [one for one in dir(kind) if one.startswith(f"fmi{version}")]
    missing = [one for one in names if f"{one}(" not in source]
    return "\n".join(f"int {one}(void) {{ return 3; }}" for one in missing)


def _compiled(folder: Path, name: str, source: str) -> Path:
    (folder / f"{name}.c").write_text(source)
    binary = folder / f"{name}{fmpy.sharedLibraryExtension}"
    command = [
        COMPILER,
        "-O2",
        "-shared",
        "-fPIC",
        "-w",
        "-o",
        binary,
        f"{name}.c",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return binary


def description(version: int, name: str = "drive") -> str:
    """modelDescription.xml of the plant."""
    kinds = ["input"] * 2 + ["output"] * 2 + ["parameter"] * 3 + ["local"]
    starts = [0.0, 0.0, None, None, *STARTS.values(), 0.0]
    lines = []
    for number, (one, kind, start) in enumerate(
        zip(NAMES, kinds, starts, strict=True), 1
    ):
        words = f'name="{one}" valueReference="{number}" causality="{kind}"'
        words += ' variability="tunable"' if kind == "parameter" else ""
        words += ' initial="exact"' if kind in ("parameter", "local") else ""
        given = "" if start is None else f' start="{start}"'
        lines.append(
            f"<ScalarVariable {words}><Real{given}/></ScalarVariable>"
            if version == 2
            else f"<Float64 {words}{given}/>"
        )
    # Of another type, a constant, a result of parameters, and an array.
    lines += (
        [
            '<ScalarVariable name="mode" valueReference="20" causality="parameter" '
            'variability="fixed"><Integer start="1"/></ScalarVariable>',
            '<ScalarVariable name="mass_kg" valueReference="21" causality="local" '
            'variability="constant" initial="exact"><Real start="0.3"/></ScalarVariable>',
            '<ScalarVariable name="poles" valueReference="22" causality="'
            'calculatedParameter" variability="fixed"><Real/></ScalarVariable>',
        ]
        if version == 2
        else [
            '<Int32 name="mode" valueReference="20" causality="parameter" '
            'variability="fixed" start="1"/>',
            '<Float64 name="mass_kg" valueReference="21" causality="local" '
            'variability="constant" initial="exact" start="0.3"/>',
            '<Float64 name="poles" valueReference="22" causality="calculatedParameter" '
            'variability="fixed"/>',
            '<Float64 name="table" valueReference="23" causality="output">'
            '<Dimension start="2"/></Float64>',
        ]
    )
    identity = 'guid="1"' if version == 2 else 'instantiationToken="1"'
    exact = "2.0" if version == 2 else "3.0"
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="{exact}" modelName="{name}" {identity}>
<CoSimulation modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"/>
<ModelVariables>
{chr(10).join(lines)}
</ModelVariables>
<ModelStructure/>
</fmiModelDescription>
"""
