"""Clusters that do not work: one line within ten seconds each, and a cluster with TLS."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import pytest

from tests import dask_processes
from tests.bad_input import trial

distributed = pytest.importorskip("distributed")
# Time to tell, and to start the program on a machine that is busy.
MOST_S, BUSY_S = 10.0, 5.0
PROJECT = Path(__file__).parents[2]
WITHOUT = (
    "import sys; sys.modules['hwid_cli'] = None; "
    "from distributed.cli.dask_worker import main; main()"
)


@pytest.fixture
def config(tmp_path):
    trial.make_good(tmp_path / "work")
    path = tmp_path / "work" / "config.yaml"
    text = path.read_text().replace("[1, 2]", "[1, 4]")
    path.write_text(f"{text}fit: {{units: 3, starts: 1, max_iterations: 3}}\n")
    # What is left is what the cluster takes.
    words = [sys.executable, "-m", "hwid_cli", "calibrate", path]
    subprocess.run([*words, "--out", path.parent / "out"], check=True)
    return path


def start(config, address, *options, is_quiet=True, **settings):
    words = ["identify", config, "--out", config.parent / "out", "--backend", "dask"]
    if is_quiet:
        # What is left on stderr is the complaint.
        words.append("--quiet")
    return subprocess.Popen(
        [sys.executable, "-m", "hwid_cli", *words, "--scheduler", address, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **settings,
    )


def assert_one_line(process, *words, most_s=MOST_S):
    begin = time.monotonic()
    try:
        said, complaint = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        pytest.fail(f"no end: {process.communicate()}")
    assert time.monotonic() - begin < most_s + BUSY_S, complaint
    assert process.returncode == 1, (said, complaint)
    assert len(complaint.splitlines()) == 1, complaint
    assert all(word in complaint for word in words), complaint


@contextmanager
def server(answer):
    """Something that listens and is no scheduler."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        held = []

        def serve():
            while True:
                try:
                    one, _ = listening.accept()
                except OSError:
                    return
                held.append(one)
                one.sendall(answer)

        threading.Thread(target=serve, daemon=True).start()
        yield f"tcp://127.0.0.1:{listening.getsockname()[1]}"
        for one in held:
            one.close()


@pytest.mark.thorough
@pytest.mark.parametrize(
    "answer",
    [
        b"",
        pytest.param(b"HTTP/1.1 400 No\r\n\r\n" + b"x" * 4000, marks=pytest.mark.slow),
        pytest.param(os.urandom(4096), marks=pytest.mark.slow),
    ],
    ids=["silent", "http", "garbage"],
)
def test_a_server_that_is_no_scheduler_is_one_line(config, answer):
    with server(answer) as address:
        assert_one_line(start(config, address), address, "dask scheduler")


@pytest.mark.slow
def test_nobody_there_is_one_line(config):
    assert_one_line(start(config, "tcp://127.0.0.1:1"), "tcp://127.0.0.1:1")


@pytest.mark.thorough
def test_tls_without_settings_is_one_line(config):
    process = start(config, "tls://127.0.0.1:8786")

    assert_one_line(process, "tls://127.0.0.1:8786", "distributed.comm.tls")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "most_s"),
    # One that is stopped may only be busy.
    [
        (signal.SIGKILL, MOST_S),
        (signal.SIGSTOP, 30),
    ],
)
def test_a_scheduler_that_goes_away_in_mid_run_is_one_line(
    config, tmp_path, number, most_s
):
    with dask_processes.scheduler(tmp_path) as (address, scheduler):
        # No worker: the run waits, and everything of it is under way.
        process = start(config, address)
        time.sleep(2 * BUSY_S)
        assert process.poll() is None, process.communicate()
        os.kill(scheduler, number)
        assert_one_line(process, address, "dask scheduler", most_s=most_s)


@pytest.mark.slow
def test_a_worker_without_the_package_is_one_line(config, tmp_path):
    with dask_processes.scheduler(tmp_path) as (address, _):
        words = [address, "--no-nanny", "--nthreads", "1", "--no-dashboard"]
        worker = subprocess.Popen(
            [sys.executable, "-c", WITHOUT, *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=tmp_path,
        )
        try:
            with distributed.Client(address, timeout=60) as client:
                client.wait_for_workers(1, timeout=60)
            assert_one_line(start(config, address), address, "install")
        finally:
            worker.kill()
            worker.wait()


def certificates(folder):
    """Certificates as docs/security.md makes them."""
    text = (PROJECT / "docs" / "security.md").read_text()
    commands = text.partition("```sh\n")[2].partition("```")[0]
    assert "openssl" in commands
    subprocess.run(
        ["sh", "-e", "-c", commands], cwd=folder, check=True, capture_output=True
    )


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl")
def test_a_cluster_with_certificates_computes_and_refuses_others(config, tmp_path):
    """As docs/security.md says: its commands, and its settings."""
    certificates(tmp_path)
    settings = {
        "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "true",
        "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": str(tmp_path / "ca.pem"),
    }
    for part in ("SCHEDULER", "WORKER", "CLIENT"):
        own = f"DASK_DISTRIBUTED__COMM__TLS__{part}__"
        settings[f"{own}CERT"] = settings[f"{own}KEY"] = str(tmp_path / "cluster.pem")
    env = {**os.environ, **settings, "PYTHONPATH": str(PROJECT)}
    where = tmp_path / "scheduler.json"
    with ExitStack() as stack:

        def started(module, *words):
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{module}", *words],
                env=env,
                cwd=tmp_path,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)

        words = ("--no-dashboard", "--protocol", "tls", "--host", "127.0.0.1")
        started("scheduler", *words, "--port", "0", "--scheduler-file", str(where))
        address = address_in(where)
        started("worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard")
        ran = start(config, address, is_quiet=False, env=env)
        _, said = ran.communicate(timeout=120)
        stranger = start(config, address, "--force")

        assert address.startswith("tls://")
        assert ran.returncode == 0, said
        assert "16 computed" in said
        assert_one_line(stranger, address, "distributed.comm.tls")


def address_in(path):
    limit = time.monotonic() + 60
    while time.monotonic() < limit:
        with suppress(FileNotFoundError, ValueError):
            return json.loads(path.read_text())["address"]
        time.sleep(0.1)
    raise AssertionError("the scheduler does not start")
