"""The served model turns refusals into sentences and never sends a traceback."""

from types import SimpleNamespace

import pytest
from mlflow.exceptions import MlflowException

from odisar.errors import OdisarError
from odisar.tracking.served_model import ServedModel


def answer(fault):
    def assess(_table):
        raise fault

    model = ServedModel()
    model.deployed = SimpleNamespace(assess=assess)
    with pytest.raises(MlflowException) as caught:
        model.predict(None, None)
    return caught.value


def test_a_refusal_is_the_clients_fault_and_says_why():
    error = answer(OdisarError("column 'Speed', row 3: the value is missing"))
    assert error.get_http_status_code() == 400
    assert error.message == "column 'Speed', row 3: the value is missing"


def test_a_fault_of_the_program_is_said_without_its_insides(caplog):
    error = answer(ValueError("/secret/path"))
    assert error.get_http_status_code() == 500
    assert "unexpected ValueError" in error.message
    assert "secret" not in error.serialize_as_json()
    assert "stack_trace" not in error.serialize_as_json()
    assert "/secret/path" in caplog.text
