"""MLflow's own server in front of a registered bundle: answers, and refusals that are sentences."""

import contextlib
import http.client
import json
import os
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mlflow
import pandas as pd
import pytest

from odisar.config.registry import ChampionRule
from odisar.deployment.bundle import read_bundle
from odisar.tracking import Tracker, tracking_uri
from odisar.tracking.registry import register
from small_bundle import MAX_ROWS, development_score, pushed, table_of, write_small_bundle
from small_system import make_recording

pytestmark = pytest.mark.slow
JSON, CSV = "application/json", "text/csv"


@pytest.fixture(scope="module")
def bundle(trained_twin, tmp_path_factory):
    return write_small_bundle(tmp_path_factory.mktemp("bundles") / "small", trained_twin)


@pytest.fixture(scope="module")
def port(bundle, tmp_path_factory):
    """Return the port on loopback on which the champion is served."""
    root = tmp_path_factory.mktemp("served")
    (root / "params.yaml").write_text("seed: 1\n")
    before = mlflow.get_tracking_uri()
    run = Tracker(root, "trial").parent()
    rule = ChampionRule(metric="auroc", margin=0.0)
    register(root, run, bundle, development_score(), rule, lambda _: development_score())
    mlflow.set_tracking_uri(before)
    with contextlib.closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {
        "MLFLOW_TRACKING_URI": tracking_uri(root),
        "MLFLOW_ALLOW_PICKLE_DESERIALIZATION": "false",
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
    }
    command = "mlflow models serve -m models:/trial.small@champion --env-manager local --workers 1"
    arguments = [*command.split(), "--host", "127.0.0.1", "--port", str(number)]
    log = (root / "server.log").open("w")
    with subprocess.Popen(
        [sys.executable, "-m", *arguments],
        cwd=root,
        env=environment,
        stdout=log,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    ) as server:
        try:
            _wait(number, server, root / "server.log")
            yield number
        finally:
            os.killpg(server.pid, 15)  # its own session: the server and its worker, nothing else
    log.close()


def _wait(port: int, server: "subprocess.Popen[bytes]", log: Path) -> None:
    for _ in range(240):
        assert server.poll() is None, log.read_text()
        with contextlib.suppress(OSError):
            if ask(port, "GET", "/ping")[0] == 200:
                return
        time.sleep(0.25)
    raise AssertionError(log.read_text())


def ask(port, method, path, body=None, kind=JSON):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    try:
        connection.request(method, path, body, {"Content-Type": kind})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


def invoke(port, body, kind=JSON):
    return ask(port, "POST", "/invocations", body, kind)


def as_split(table):
    split = table.to_dict(orient="split", index=False)
    return json.dumps({"dataframe_split": split})


def as_records(table):
    return json.dumps({"dataframe_records": table.to_dict(orient="records")})


def as_csv(table):
    return table.to_csv(index=False, float_format="%.17g")


@pytest.fixture
def table():
    return table_of(pushed("asked", 120), named=True)


@pytest.mark.parametrize(("write", "kind"), [(as_split, JSON), (as_records, JSON), (as_csv, CSV)])
def test_a_good_request_gets_the_assessments(port, bundle, table, write, kind):
    status, answer = invoke(port, write(table), kind)
    assert status == 200, answer
    said = pd.DataFrame(json.loads(answer)["predictions"])
    pd.testing.assert_frame_equal(said, read_bundle(bundle).assess(table))


def test_many_requests_at_once_get_the_same_answer(port, table):
    body = as_split(table)
    with ThreadPoolExecutor(6) as pool:
        answers = list(pool.map(lambda _: invoke(port, body), range(12)))
    assert set(answers) == {(200, answers[0][1])}


def cell(row, value):
    return lambda table: as_split(table.astype({"Speed": object}).pipe(_set, row, value))


def _set(table, row, value):
    table.at[row, "Speed"] = value  # noqa: PD008 (a list is a value here)
    return table


BAD = {
    "missing column": (lambda t: as_split(t.drop(columns="Speed")), "lacks the column 'Speed'"),
    "surplus column": (lambda t: as_split(t.assign(Wind=1.0)), "unknown column 'Wind'"),
    "misspelt column": (
        lambda t: as_split(t.rename(columns={"Speed": "Sped"})),
        "rename 'Sped' to 'Speed'",
    ),
    "NaN": (cell(7, float("nan")), "column 'Speed', row 7: the value is missing"),
    "null": (cell(7, None), "column 'Speed', row 7: the value is missing"),
    "infinity": (cell(7, float("inf")), "column 'Speed', row 7: the value is infinite"),
    "text": (cell(7, "fast"), "row 7: the value is no number (fast)"),
    "a list": (cell(7, [1.0]), "row 7: the value is no number"),
    "out of range": (cell(7, 99.0), "row 7: the value is outside -20 to 20 m/s (99)"),
    "too short": (lambda t: as_split(t.iloc[:20]), "shorter than one window"),
    "empty": (lambda t: as_split(t.iloc[:0]), "no rows"),
    "too long": (
        lambda _: as_split(table_of(make_recording("long", MAX_ROWS + 1))),
        f"{MAX_ROWS + 1} rows, more than the {MAX_ROWS}",
    ),
    "backwards": (lambda t: as_split(t.iloc[::-1]), "the time goes back"),
    "another rate": (lambda t: as_split(t.assign(time_s=t.time_s / 4)), "rate is not rate_hz=1"),
    "tensor": (lambda _: json.dumps({"inputs": [[1.0, 2.0]]}), "must be a table"),
    "instances": (lambda _: json.dumps({"instances": [1.0, 2.0]}), "must be a table"),
    "no JSON": (lambda _: "time_s,Speed", "valid JSON"),
    "no text": (lambda _: b"\xff\xfe\x00", "valid JSON"),
    "a JSON list": (lambda _: "[1, 2]", "must be a JSON dictionary"),
    "another key": (lambda _: '{"samples": []}', "must be a JSON dictionary"),
    "ragged": (
        lambda _: json.dumps({"dataframe_split": {"columns": ["a"], "data": [[1, 2], [3]]}}),
        "dataframe_split",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_request_is_refused_in_a_sentence(port, table, name):
    write, sentence = BAD[name]
    status, answer = invoke(port, write(table))
    assert status == 400, answer
    said = json.loads(answer)
    assert sentence in said["message"]
    assert said["error_code"] in ("BAD_REQUEST", "INVALID_PARAMETER_VALUE")
    assert "stack_trace" not in said
    assert "Traceback" not in answer
    assert 'File "' not in answer


def test_a_bad_cell_of_a_csv_is_refused_in_a_sentence(port, table):
    status, answer = invoke(port, as_csv(_set(table.astype({"Speed": object}), 7, "fast")), CSV)
    assert status == 400
    assert "column 'Speed'" in json.loads(answer)["message"]
    assert "Traceback" not in answer


def test_after_all_of_that_it_still_answers(port, table):
    assert invoke(port, as_split(table))[0] == 200
