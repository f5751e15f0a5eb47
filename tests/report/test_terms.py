"""Short heads of tables are explained where they stand."""

import re
from dataclasses import replace

import pytest

from hwid_cli.report.html import report_page
from hwid_cli.report.table import Table, numbers
from hwid_cli.report.terms import explanation
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from tests.report.report_examples import everything

SHORT = ("covers", "widest", "not self", "not cross", "nb", "nk")


@pytest.fixture(scope="module")
def html():
    return report_page(report_contents(everything(6, levels=2)), STAGES).html


def tables_of(html):
    """Heads of each table, and what stands between it and the next one."""
    parts = re.split(r"<table", html)[1:]
    for part in parts:
        inside, _, below = part.partition("</table>")
        heads = re.findall(r"<th[^>]*>([^<]*)</th>", inside)
        yield heads, below


def test_no_short_head_stands_on_the_page_without_its_meaning(html):
    met = set()
    for heads, below in tables_of(html):
        for head in set(heads) & set(SHORT):
            met.add(head)
            assert f"{head}: " in below, (head, heads)
    assert met == set(SHORT)


def test_the_second_order_is_called_what_it_counts():
    table = Table("", numbers("nk", "RMSD"), ())
    assert explanation(table, "poles") == "nk: poles."
    assert explanation(table, "delay") == "nk: samples of delay."
    assert explanation(Table("", numbers("RMSD"), ()), "poles") == ""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("role", "said"), [("poles", "poles"), ("delay", "samples of delay")]
)
def test_the_answer_and_the_grids_say_what_orders_count(role, said):
    stored = replace(everything(6, levels=2), nk_role=role)
    html = report_page(report_contents(stored), STAGES).html
    text = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", "", html))
    assert f"over nb (coefficients of the numerator) and nk ({said});" in text
    assert re.search(r"\S+: nb = \d+ coefficients? of the numerator, nf = \d+ ", text)
    assert "[nb nf nk]" not in text
    assert "The widest model" not in text
