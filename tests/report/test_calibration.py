from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.report.calibration import calibration_table
from hwid_cli.report.table import as_text


def test_the_calibration_table_says_what_was_done():
    log = CalibrationLog(
        name="sine_01",
        steps=("cut", "input_offset", "recut"),
        first_sample=248,
        n_samples=7490,
        n_raw_input=7929,
        n_raw_output=7784,
        input_offset=0.00666,
        period_samples=12.566,
        repaired_input=(3, 5),
    )
    text = as_text([calibration_table([log])])

    assert text.splitlines()[-1].split() == [
        "sine_01", "7929/7784", "248", "7490", "6.66e-03", "-", "12.57", "2/0",
    ]  # fmt: skip
    assert max(map(len, text.splitlines())) <= 80
