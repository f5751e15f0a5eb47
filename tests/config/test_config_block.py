"""The keys ``fit.linear_block`` of a configuration."""

import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.records.model import LinearBlock
from hwid_cli.tasks.cache import task_key

BLOCK = "{numerator: [0.02, 0.01], denominator: [1, -1.6, 0.65], frozen: true}"


def load(tmp_path, orders, block, more=""):
    path = tmp_path / "c.yaml"
    path.write_text(
        f"name: c\norders: {orders}\nfit: {{linear_block: {block}{more}}}\n",
        encoding="utf-8",
    )
    return load_experiment(path)


def test_a_block_is_read(tmp_path):
    fit = load(tmp_path, "{nb: 2, nk: 2}", BLOCK).fit
    assert fit.linear_block == LinearBlock((0.02, 0.01), (1.0, -1.6, 0.65), 1, True)


def test_every_number_of_a_block_is_part_of_the_key(tmp_path):
    texts = [
        BLOCK,
        BLOCK.replace("0.02", "0.021"),
        BLOCK.replace("0.65", "0.66"),
        BLOCK.replace("true", "false"),
    ]
    keys = {
        task_key("fit", 1, load(tmp_path, "{nb: 2, nk: 2}", text).fit, [])
        for text in texts
    }
    assert len(keys) == len(texts)


@pytest.mark.parametrize(
    ("orders", "block", "message"),
    [
        ("{nb: [1, 3], nk: 2}", BLOCK, r"set orders: \{nb: 2, nk: 2\}"),
        (
            "{nb: 2, nk: 2}",
            BLOCK.replace("frozen", "delay: 3, frozen"),
            r"found delay 3; expected 1 .* set orders: \{nb: 2, nf: 2, nk: 3, nk_role",
        ),
        (
            "{nb: 2, nk: 1, nf: 3, nk_role: delay}",
            BLOCK,
            "found poles 2; expected 3",
        ),
        ("{nb: 2, nk: 2}", BLOCK.replace("[1,", "[2,"), "denominator: must start with"),
        (
            "{nb: 2, nk: 2}",
            BLOCK.replace("0.65", "1.65"),
            r"found a pole at radius 1.285; expected all poles .* inside radius 1;",
        ),
        (
            "{nb: 2, nk: 2}",
            BLOCK + ", largest_pole_radius: 0.7",
            r"denominator: found a pole at radius 0.8062; expected .* inside radius 0.7",
        ),
        (
            "{nb: 1, nk: [1, 3]}",
            BLOCK.replace("true", "false"),
            "found 2 numerator coefficients, 2 poles and delay 1, which no orders",
        ),
        ("{nb: 2, nk: 2}", "{numerator: [1]}", "linear_block.denominator: missing"),
        ("{nb: 2, nk: 2}", BLOCK + ", largest_pole_radius: 2", "largest_pole_radius"),
    ],
)
def test_what_does_not_fit_is_told_in_one_line(tmp_path, orders, block, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load(tmp_path, orders, block)
    assert "\n" not in str(caught.value)


def test_a_delay_grid_takes_a_frozen_block_of_another_delay(tmp_path):
    block = BLOCK.replace("frozen", "delay: 3, frozen")
    orders = "{nb: 2, nk: 3, nf: 2, nk_role: delay}"
    assert load(tmp_path, orders, block).fit.linear_block.delay == 3


def test_a_block_that_is_a_start_may_be_of_any_orders(tmp_path):
    assert load(
        tmp_path, "{nb: [1, 3], nk: [1, 3]}", BLOCK.replace("true", "false")
    ).fit.linear_block


def test_delays_are_read_and_refused_where_the_grid_tries_them(tmp_path):
    path = tmp_path / "c.yaml"
    path.write_text("name: c\nfit: {delays: [3, 1]}\n", encoding="utf-8")
    assert load_experiment(path).fit.delays == (1, 3)
    path.write_text(
        "name: c\norders: {nk_role: delay, nf: 2}\nfit: {delays: [3, 1]}\n",
        encoding="utf-8",
    )
    with pytest.raises(ConfigError, match=r"fit.delays: found \[1, 3\]; expected none"):
        load_experiment(path)
