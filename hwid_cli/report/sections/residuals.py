"""Section about residuals: what the best models leave, and what that shows."""

from hwid_cli.records.report import ReportContents, SimulatedRecording
from hwid_cli.report.figures.residuals import residuals_figure
from hwid_cli.report.page import Block, Figures, Folded, Section, Table, Text
from hwid_cli.report.residual_tables import p_words, residual_verdict
from hwid_cli.report.sections.words import (
    counted,
    drawn,
    file_names,
    simulation_note,
    with_unit,
)
from hwid_cli.report.text_table import MISSING

# Figures that are shown open.
_MOST_OPEN = 2
_HOW = (
    "White residuals that do not follow the input leave nothing to model. Those that follow "
    "it show missing dynamics, those that follow its square a missing nonlinearity. "
    "Coloured ones that follow neither are noise, or follow the input in a way that these "
    "tests do not see (a sine shows least); standard errors are too small then. "
    "With many samples the tests find what no user would mind: read the RMSD beside them."
)


def residuals_section(contents: ReportContents) -> Section:
    """Show the tests of the residuals of each recording's best model."""
    tested = [one for one in contents.simulated if one.tests is not None]
    blocks: list[Block] = []
    if not tested:
        blocks.append(Text("No models yet: run 'hwid identify CONFIG'.", is_note=True))
    else:
        blocks.append(Text(_HOW))
        blocks += simulation_note(contents, is_validation=True)
        blocks.append(_table(tested))
        files = file_names([one.recording.name for one in tested], ("",))
        shown = [_figure(one, files[one.recording.name]) for one in tested]
        blocks += shown[:_MOST_OPEN]
        rest = tuple(shown[_MOST_OPEN:])
        if rest:
            summary = f"Residuals of {counted(len(rest), 'more recording')}"
            blocks.append(Folded(summary, rest))
    title = "Residuals: what the best models leave"
    return Section("residuals", title, "Residuals", tuple(blocks))


def _table(tested: list[SimulatedRecording]) -> Table:
    rows = []
    for one in tested:
        tests = one.tests
        if tests is None:
            continue
        itself = tests.with_itself
        rows.append(
            (
                one.recording.name,
                one.model,
                with_unit(one.rmsd, one.recording.output_unit),
                f"{tests.ljung_box:.3g} ({itself.lags.size})",
                p_words(itself.p_value),
                p_words(tests.with_input.p_value),
                _lag(tests.with_input.last_lag),
                p_words(tests.with_square.p_value),
                residual_verdict(tests).partition(": ")[2],
            )
        )
    heads = (
        "recording",
        "model",
        "RMSD",
        "Ljung-Box (lags)",
        "white",
        "follows input",
        "last lag [samples]",
        "follows its square",
        "verdict",
    )
    caption = "Probability that chance alone gives correlations as large"
    return Table(caption, heads, tuple(rows), text_columns=(0, 1, 8))


def _lag(lag: int) -> str:
    return str(lag) if lag >= 0 else MISSING


def _figure(one: SimulatedRecording, file: str) -> Figures:
    name = one.recording.name
    alt = f"Correlations of the residual of {name} with itself and with the input"
    verdict = "" if one.tests is None else residual_verdict(one.tests)
    sentence = (
        f"{name} with {one.model}: residuals are {verdict}. Shaded: 95 % of the values "
        "without any correlation; dashed: 95 % of cases have all values within."
    )
    drawing = residuals_figure(one)
    return Figures((drawn(f"residuals/{file}", drawing, alt),), sentence)
