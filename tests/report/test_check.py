import json
import re

from hwid_cli.records.check import FitCost, RecordingFacts, StagePlan
from hwid_cli.report.check import check_document, recordings_table, stages_table
from hwid_cli.report.table import as_text


def test_ranges_have_no_unit_where_there_is_none_and_no_negative_zero():
    facts = RecordingFacts(
        "a", "step", 9, 9, 9, 1e-3, (-0.288, 0.129), (-0.0, 2.0), "-", "V"
    )

    text = as_text([recordings_table([facts])])
    assert re.search(r"-0\.288 to 0\.129  +0 to 2 V", text)


def test_the_plan_sums_what_is_known_and_says_what_is_not():
    plans = [
        StagePlan("identify", "8 fits", 8, 2, 60.0, 1e6),
        StagePlan("group", "at most 4 groups", 4, None, 20.0, 2e6, 300.0, "it goes on"),
        StagePlan("diagnose", "a search", 1, None, float("nan"), 0.0),
    ]
    table = stages_table(plans, FitCost(0.02, 300, 3.0, 10, "one fit of a"), workers=1)

    assert table.rows[0] == ("identify", "8 fits", "2 of 8", "60 s")
    assert table.rows[1][3] == "20 s to 5 min"
    assert table.rows[2][2:] == ("-", "-")
    assert table.notes == (
        "Estimate, to a factor of 2: 80 s to 6 min on 1 process, start of the program and "
        "diagnose apart.",
        "group: 5 min if it goes on.",
        "Scaled from one fit of a: 0.020 s for 300 samples.",
        "Disk: about 3 MB more.",
    )


def test_programs_read_the_same_range_and_null_for_what_is_not_known():
    plans = [
        StagePlan("group", "4 groups", 4, None, 20.0, 2e6, 300.0, "it goes on"),
        StagePlan("diagnose", "a search", 1, None, float("nan"), 0.0),
    ]
    document = json.loads(json.dumps(check_document([], plans, 2), allow_nan=False))

    group, diagnose = document["stages"]
    assert (group["seconds"], group["most_seconds"]) == (20.0, 300.0)
    assert group["most_reason"] == "it goes on"
    assert (diagnose["seconds"], diagnose["most_seconds"]) == (None, None)
    assert (document["seconds"], document["most_seconds"]) == (20.0, 300.0)
    assert document["processes"] == 2
