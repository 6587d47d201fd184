"""A stranger's ROS 2 bags become a profile."""

import re

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from odisar.config.loader import load_config
from odisar.workspaces import lay_out

from .strangers import run

pytestmark = pytest.mark.usefixtures("root")
STORE = get_typestore(Stores.ROS2_HUMBLE)


def write_bag(path, seed, seconds=60.0, unstamped=0):
    """Write odometry at 50 Hz and an inertial sensor at 100 Hz, as a robot's recorder does."""
    kinds = STORE.types
    vector, point = kinds["geometry_msgs/msg/Vector3"], kinds["geometry_msgs/msg/Point"]
    random = np.random.default_rng(seed)
    yaw = x = y = turn = 0.0

    def header(nanoseconds):
        stamp = kinds["builtin_interfaces/msg/Time"](
            sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9
        )
        return kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="base")

    def around(z):
        return vector(*(float(0.01 * value) for value in random.normal(size=2)), z=z)

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        odometry = writer.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=STORE)
        imu = writer.add_connection("/imu/data", "sensor_msgs/msg/Imu", typestore=STORE)
        for i in range(round(100 * seconds)):
            at = 1_700_000_000_000_000_000 + i * 10_000_000
            turn = 0.98 * turn + 0.05 * random.normal()
            yaw, x, y = yaw + turn / 100, x + np.cos(yaw) / 200, y + np.sin(yaw) / 200
            facing = kinds["geometry_msgs/msg/Quaternion"](
                x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2))
            )
            stamp = 0 if i < unstamped else at
            measured = kinds["sensor_msgs/msg/Imu"](
                header(stamp),
                facing,
                np.zeros(9),
                around(turn),
                np.zeros(9),
                around(9.8),
                np.zeros(9),
            )
            raw = STORE.serialize_cdr(measured, "sensor_msgs/msg/Imu")
            writer.write(imu, at, raw)
            if i % 2:
                continue
            pose = kinds["geometry_msgs/msg/Pose"](point(float(x), float(y), 0.0), facing)
            twist = kinds["geometry_msgs/msg/Twist"](around(0.0), around(turn))
            moved = kinds["nav_msgs/msg/Odometry"](
                header(at),
                "base",
                kinds["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                kinds["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
            )
            writer.write(odometry, at, STORE.serialize_cdr(moved, "nav_msgs/msg/Odometry"))


def test_every_bag_of_a_folder_of_bad_ones_is_told(folder, capsys):
    for name in "abcd":
        (folder / f"{name}.mcap").write_text("x" if name != "c" else "")
    assert run("new-case", folder) == 1
    error = capsys.readouterr().err
    assert "none of the 4 recordings can be read" in error
    for name in "abd":
        assert re.search(rf"^{name}\.mcap +{name}\.mcap is cut off or damaged", error, re.MULTILINE)
    assert re.search(r"^c\.mcap +the file is empty +record it again", error, re.MULTILINE)


def test_bags_are_read_by_their_odometry(root, folder, capsys):
    for seed in range(2):
        write_bag(folder / f"run_{seed}", seed)
    assert run("new-case", folder, "--name", "base", "--write") == 0
    assert "2 recordings, 2 of them sound" in capsys.readouterr().err
    case = load_config(lay_out(root, "base")).cases["base"]
    bag = case.source.bag
    assert (bag.stamp_topic, bag.stamp) == ("/odom", "header")
    assert bag.fields["position_x"] == "/odom:pose.pose.position.x"
    assert bag.fields["linear_acceleration_x"] == "/imu/data:linear_acceleration.x"
    assert "position_z" not in bag.fields
    assert (case.rate_hz, case.source.resample) == (10.0, "thin")
    assert case.pose.heading == ["orientation_z", "orientation_w"]
    units = {channel.name: channel.unit for channel in case.channels}
    assert units["angular_velocity_z"] == "rad/s"
    assert units["position_x"] == "m"


def test_some_headers_without_a_stamp_make_the_time_of_receipt_the_clock(root, folder, capsys):
    write_bag(folder / "run_0", 0, unstamped=3)
    assert run("new-case", folder, "--name", "base", "--write") == 0
    printed = capsys.readouterr()
    assert "the header's stamp is 0 in messages of /imu/data" in printed.out
    assert "1 recording, 1 of them sound" in printed.err
    assert load_config(lay_out(root, "base")).cases["base"].source.bag.stamp == "received"
