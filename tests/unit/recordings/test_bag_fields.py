"""Topics, fields and message definitions that a bag has, or has not."""

import shutil

import numpy as np
import pytest
from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinition,
    MessageDefinitionFormat,
    Nodetype,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import TypesysError
from rosbags.typesys.store import Typestore

from odisar.recordings import bag_definitions
from odisar.recordings.bag_definitions import definitions

START_NS = 1_700_000_000_000_000_000
SAMPLES = 30


def of_topic(messages, topic):
    return [message for message in messages if message[0] == topic]


def without(messages, topic):
    return [message for message in messages if message[0] != topic]


def test_a_case_that_does_not_say_what_to_take(boat, ros, messages):
    ros.write(boat.folder / "a", messages)
    finding = boat.one("does not say what to take from a bag")
    assert "declare source.bag" in finding.remedy
    assert "/odom (nav_msgs/msg/Odometry), /rudder (std_msgs/msg/Float64)" in finding.remedy


def test_a_topic_that_is_not_there(boat_with, ros, messages):
    boat = boat_with({"Rudder": "/ruder:data"})
    ros.write(boat.folder / "a", messages)
    finding = boat.one("the bag has no such topic")
    assert finding.column == "/ruder"
    assert "the bag has /rudder (std_msgs/msg/Float64), /joint_states" in finding.remedy


def test_a_stamp_topic_that_is_not_there(boat_with, ros, messages):
    boat = boat_with(stamp_topic="/pose")
    ros.write(boat.folder / "a", messages)
    assert boat.one("the bag has no such topic").column == "/pose"


def test_a_topic_without_messages(bag_boat, ros, messages, storage):
    rudder = of_topic(messages, "/rudder")[:1]
    ros.write(bag_boat.folder / "a", without(messages, "/rudder") + rudder, storage)
    path = bag_boat.folder / "b"
    with Writer(path, version=9, storage_plugin=ros.storage(storage)) as writer:
        for topic, kind, _, _ in messages[:3]:
            writer.add_connection(topic, kind, typestore=ros.types())
    found = bag_boat.found("the topic has no messages")
    assert [(finding.file, finding.column) for finding in found] == [
        ("boat/b", "/odom"),
        ("boat/b", "/rudder"),
        ("boat/b", "/joint_states"),
    ]


@pytest.mark.parametrize(
    ("path", "problem", "remedy"),
    [
        ("/odom:twist.twist.linear.v", "Vector3 has no field 'v'", "it has: x, y, z"),
        ("/odom:twist.twst.linear.x", "no field 'twst'", "it has: twist, covariance"),
        ("/odom:child_frame_id", "child_frame_id is no number but a string", "another field"),
        ("/odom:twist.twist.linear", "is a message", "twist.twist.linear.x"),
        ("/odom:twist.covariance", "is an array", "twist.covariance[0]"),
        ("/odom:twist.covariance[36]", "covariance has 36 elements", "from 0 to 35"),
        ("/odom:twist.twist.linear.x[0]", "'x' is no array", "leave out [0]"),
        ("/odom:twist.twist.linear.x.y", "a float64 has no field 'y'", "leave out .y"),
        ("/joint_states:position.x", "an array has no fields", "name an element"),
        ("/joint_states:name[0]", "no number but a string", "another field"),
    ],
)
def test_a_field_that_is_not_there_or_is_no_number(boat_with, ros, messages, path, problem, remedy):
    boat = boat_with({"Speed": path})
    ros.write(boat.folder / "a", messages)
    finding = boat.one(problem)
    assert (finding.column, finding.value) == ("Speed", path.partition(":")[2])
    assert remedy in finding.remedy


def test_a_message_with_too_few_elements(bag_boat, ros, messages):
    short = [ros.joints(4.5, [0.0])]
    ros.write(bag_boat.folder / "a", messages + short)
    finding = bag_boat.one("too few elements for position[1]")
    assert (finding.column, finding.row) == ("Heading", 6)
    assert [found for found in bag_boat.read().findings if found != finding] == []


def test_times_and_whole_numbers_are_numbers(boat_with, ros, messages):
    boat = boat_with({"Rudder": "/odom:header.stamp", "Speed": "/odom:header.stamp.nanosec"})
    tenths = [ros.odometry(i + i / 1000, 1.0) for i in range(SAMPLES)]
    ros.write(boat.folder / "a", without(messages, "/odom") + tenths)
    problems = {found.problem for found in boat.read().findings}
    assert problems == {"the value is outside -15 to 15 m/s", "the value is outside -60 to 60 deg"}
    assert boat.found("-60 to 60")[0].value == "1700000000"
    assert boat.found("-15 to 15")[0].value == "1000000"


def test_a_stamp_topic_without_headers(boat_with, ros, messages):
    boat = boat_with(stamp_topic="/rudder")
    ros.write(boat.folder / "a", messages)
    finding = boat.one("messages of the stamp topic have no header")
    assert (finding.column, finding.value) == ("/rudder", "std_msgs/msg/Float64")
    assert "stamp: received" in finding.remedy


def test_a_message_that_cannot_be_decoded(bag_boat, ros, messages, storage):
    topic, kind, arrival_ns, _ = messages[3 * 7 + 2]
    messages[3 * 7 + 2] = (topic, kind, arrival_ns, b"\x00\x01\x00\x00 cut off")
    ros.write(bag_boat.folder / "a", messages, storage)
    finding = bag_boat.one("the message cannot be decoded")
    assert (finding.column, finding.row) == ("/odom", 8)
    assert bag_boat.read().findings == [finding]


def test_a_definition_that_nobody_has(bag_boat, ros, messages):
    kind = "boat_msgs/msg/Rudder"
    with Writer(bag_boat.folder / "a", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        connection = writer.add_connection(
            "/rudder", kind, msgdef="boat_msgs/Angle angle\n", rihs01="none"
        )
        writer.write(connection, START_NS, b"\x00\x01\x00\x00")
    finding = bag_boat.one("the definition of boat_msgs/msg/Angle is unknown")
    assert finding.column == "/rudder"


BORDER = "=" * 80 + "\n"
MSG = f"boat_msgs/Angle angle\nbool starboard\n{BORDER}MSG: boat_msgs/Angle\nint16 value\n"
IDL = (
    f"{BORDER}IDL: boat_msgs/msg/Rudder\nmodule boat_msgs {{ module msg {{ struct Rudder {{ "
    "boat_msgs::msg::Angle angle; boolean starboard; }; }; };\n"
    f"{BORDER}IDL: boat_msgs/msg/Angle\nmodule boat_msgs {{ module msg {{ struct Angle {{ "
    "int16 value; }; }; };\n"
)


@pytest.mark.parametrize("text", [MSG, IDL], ids=["msg", "idl"])
def test_definitions_of_the_users_own(boat_with, ros, messages, text):
    boat = boat_with({"Rudder": "/rudder:angle.value", "Heading": "/rudder:starboard"})
    with Writer(boat.folder / "a", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odom = writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        rudder = writer.add_connection(
            "/rudder", "boat_msgs/msg/Rudder", msgdef=text, rihs01="none"
        )
        for i in range(SAMPLES):
            raw = b"\x00\x01\x00\x00" + int(-i).to_bytes(2, "little", signed=True) + bytes([i % 2])
            writer.write(rudder, ros.ns(i - 0.1), raw)
            _, kind, arrival_ns, message = messages[3 * i + 2]
            writer.write(odom, arrival_ns, ros.types().serialize_cdr(message, kind))
    result = boat.read()
    assert result.findings == []
    values = result.recordings[0].values
    np.testing.assert_array_equal(values[:, 0], -np.arange(SAMPLES))
    np.testing.assert_array_equal(values[:, 2], np.arange(SAMPLES) % 2)


def test_a_definition_that_cannot_be_understood(bag_boat, ros, messages):
    name = "boat_msgs/msg/Rudder"
    text = 'float64 data\nstring X=\'"""\nraise SystemExit\'\n1bad/Type x\n'
    with Writer(bag_boat.folder / "a", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        connection = writer.add_connection("/rudder", name, msgdef=text, rihs01="none")
        writer.write(connection, START_NS, b"\x00\x01\x00\x00")
    assert bag_boat.one("cannot be understood").column == "/rudder"


def test_a_definition_with_another_hash_than_the_messages(bag_boat, ros, messages):
    with Writer(bag_boat.folder / "a", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        connection = writer.add_connection(
            "/rudder", "std_msgs/msg/Float64", msgdef="float64 data\n", rihs01="RIHS01_0"
        )
        writer.write(connection, START_NS, b"\x00\x01\x00\x00" + bytes(8))
    assert bag_boat.one("is not the one that messages were made with").column == "/rudder"


def test_a_topic_with_messages_of_two_types(bag_boat, ros):
    types = ros.types()
    with Writer(bag_boat.folder / "a", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for kind in ("nav_msgs/msg/Odometry", "std_msgs/msg/Float64"):
            writer.add_connection("/odom", kind, typestore=types)
    finding = bag_boat.one("messages of several types")
    assert finding.value == "nav_msgs/msg/Odometry, std_msgs/msg/Float64"


@pytest.mark.parametrize("alone", [False, True])
def test_a_topic_with_messages_of_two_definitions(bag_boat, ros, messages, alone):
    """The second would be read with the first: silently as other numbers."""
    kind = "boat_msgs/msg/Rudder"
    texts = {
        "/rudder": "float64 data\nfloat64 rate\n",
        "/ruddor": "float64 rate\nfloat64 data\n",
    }
    path = bag_boat.folder / "a"
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odom = writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        for topic, text in texts.items():
            other = f"boat_msgs/msg/{topic[1:].title()}"
            rudder = writer.add_connection(topic, other, msgdef=text, rihs01="none")
            writer.write(rudder, START_NS, b"\x00\x01\x00\x00" + bytes(16))
        _, odometry, arrival_ns, message = messages[2]
        writer.write(odom, arrival_ns, ros.types().serialize_cdr(message, odometry))
    for file in path.iterdir():
        file.write_bytes(file.read_bytes().replace(b"uddor", b"udder"))
    if alone:
        (path / "a.mcap").rename(bag_boat.folder / "b.mcap")
        shutil.rmtree(path)
    finding = bag_boat.one("messages of several definitions")
    assert (finding.column, finding.value) == ("/rudder", f"2 definitions of {kind}")


def rudder_of(boat, ros, messages, text):
    with Writer(boat.folder / "a", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        writer.add_connection("/odom", messages[2][1], typestore=ros.types())
        rudder = writer.add_connection(
            "/rudder", "boat_msgs/msg/Rudder", msgdef=text, rihs01="none"
        )
        writer.write(rudder, START_NS, b"\x00\x01\x00\x00" + bytes(16))
    return boat


def definition_of(text):
    fmt = MessageDefinitionFormat.IDL if "IDL: " in text else MessageDefinitionFormat.MSG
    ext = ConnectionExtRosbag2("cdr", [])
    definition = MessageDefinition(fmt, text)
    return Connection(1, "/rudder", "boat_msgs/msg/Rudder", definition, "", 1, ext, None)


@pytest.mark.parametrize("place", ["asked for", "inner", "beside"])
@pytest.mark.parametrize("hostile", ["x: int = __import__('os')", "x\nraise SystemExit", "a b"])
def test_names_that_are_code_never_get_to_where_code_is_made(monkeypatch, place, hostile):
    number = (Nodetype.BASE, ("float64", 0))
    spoiled, sound = ([], [(hostile, number)]), ([], [("data", number)])
    inner = (Nodetype.NAME, "boat_msgs/msg/Angle")
    types = {
        "asked for": {"boat_msgs/msg/Rudder": spoiled},
        "inner": {
            "boat_msgs/msg/Rudder": ([], [("angle", inner)]),
            "boat_msgs/msg/Angle": spoiled,
        },
        "beside": {"boat_msgs/msg/Rudder": sound, "boat_msgs/msg/Angle": spoiled},
    }
    monkeypatch.setattr(bag_definitions, "_parse", lambda *_: types[place])
    monkeypatch.setattr(Typestore, "register", lambda *_: pytest.fail("code is made"))
    with pytest.raises(TypesysError, match="names that ROS does not allow"):
        definitions(definition_of(""))


def test_a_type_whose_name_is_code_is_refused_even_if_no_field_has_it(monkeypatch):
    sound = ([], [("data", (Nodetype.BASE, ("float64", 0)))])
    types = {"boat_msgs/msg/Rudder": sound, "x: int = __import__('os')": sound}
    monkeypatch.setattr(bag_definitions, "_parse", lambda *_: types)
    with pytest.raises(TypesysError, match="names that ROS does not allow"):
        definitions(definition_of(""))


def idl(body):
    return (
        f"{BORDER}IDL: boat_msgs/msg/Rudder\nmodule boat_msgs {{ module msg {{ {body} "
        "struct Rudder { double data; }; }; };\n"
    )


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("string[1001] names\n", "names of boat_msgs/msg/Rudder has more than 1,000 elements"),
        ("std_msgs/Empty[2000] data\n", "more than 1,000 elements"),
        ("float64[1000001] data\n", "more than 1,000,000 elements"),
        ("float64 data\n#" + "x" * 262_144, "more than 262,144 characters"),
        ("".join(f"int8 x{i}\n" for i in range(2001)), "more than 2,000 fields"),
        (idl("const long X = 1 << 99999999999;"), "has to be worked out"),
        (idl("const long X = " + "(" * 30 + "1" + ")" * 30 + ";"), "has to be worked out"),
        (idl('@verbatim(language="c", text="(") const long X = (1);'), "has to be worked out"),
    ],
)
def test_a_definition_that_would_take_all_time_or_memory(bag_boat, ros, messages, text, reason):
    boat = rudder_of(bag_boat, ros, messages, text)
    finding = boat.one("the definition of boat_msgs/msg/Rudder is too large")
    assert (finding.severity, finding.column) == ("error", "/rudder")
    assert reason in finding.problem


def test_comments_of_a_definition_may_hold_anything():
    body = '@verbatim(language="comment", text="a const (see << (x)) 1") // const (("'
    assert definitions(definition_of(idl(f"{body}\n"))).fielddefs
