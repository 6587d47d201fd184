"""ROS 2 messages and bags of the small boat."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORAGES = {"mcap": StoragePlugin.MCAP, "sqlite": StoragePlugin.SQLITE3}
BAG_START_NS = 1_700_000_000_000_000_000
TYPES = get_typestore(Stores.ROS2_HUMBLE)
Message = tuple[str, str, int, Any]  # topic, type, time of arrival in ns, message


class Ros:
    """Makes ROS 2 messages and bags; times are in seconds after ``BAG_START_NS``."""

    @staticmethod
    def types() -> Any:
        return TYPES

    @staticmethod
    def ns(time_s: float) -> int:
        return BAG_START_NS + round(time_s * 1e9)

    @staticmethod
    def header(stamp_ns: int) -> Any:
        stamp = TYPES.types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        return TYPES.types["std_msgs/msg/Header"](stamp, "base")

    @staticmethod
    def odometry(
        time_s: float, speed: float, stamp_ns: int | None = None, arrival_s: float | None = None
    ) -> Message:
        kinds = TYPES.types
        vector, zeros = kinds["geometry_msgs/msg/Vector3"], np.zeros(36)
        twist = kinds["geometry_msgs/msg/Twist"](vector(speed, 0.0, 0.0), vector(0.0, 0.0, 0.0))
        pose = kinds["geometry_msgs/msg/Pose"](
            kinds["geometry_msgs/msg/Point"](0.0, 0.0, 0.0),
            kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        )
        message = kinds["nav_msgs/msg/Odometry"](
            Ros.header(Ros.ns(time_s) if stamp_ns is None else stamp_ns),
            "base",
            kinds["geometry_msgs/msg/PoseWithCovariance"](pose, zeros),
            kinds["geometry_msgs/msg/TwistWithCovariance"](twist, zeros),
        )
        arrival_ns = Ros.ns(time_s + 0.05 if arrival_s is None else arrival_s)
        return "/odom", "nav_msgs/msg/Odometry", arrival_ns, message

    @staticmethod
    def joints(time_s: float, positions: Iterable[float]) -> Message:
        empty = np.empty(0)
        message = TYPES.types["sensor_msgs/msg/JointState"](
            Ros.header(Ros.ns(time_s)), ["wheel", "rudder"], np.array(positions), empty, empty
        )
        return "/joint_states", "sensor_msgs/msg/JointState", Ros.ns(time_s + 0.02), message

    @staticmethod
    def rudder(time_s: float, angle: float) -> Message:
        message = TYPES.types["std_msgs/msg/Float64"](angle)
        return "/rudder", "std_msgs/msg/Float64", Ros.ns(time_s), message

    @staticmethod
    def boat(time_s: Iterable[float], columns: dict[str, Iterable[float]]) -> list[Message]:
        """Return the messages of a recording; all topics speak shortly before each sample."""
        messages, latest_s = [], 0.0
        rows = zip(time_s, columns["Rudder"], columns["Speed"], columns["Heading"], strict=True)
        for moment_s, rudder, speed, heading in rows:
            messages.append(Ros.rudder(moment_s - 0.2, rudder))
            messages.append(Ros.joints(moment_s - 0.1, [0.0, heading]))
            # A header's clock may jump; the recorder's does not.
            latest_s = max(latest_s + 1e-6, moment_s + 0.05)
            messages.append(Ros.odometry(moment_s, speed, arrival_s=latest_s))
        return messages

    @staticmethod
    def storage(name: str) -> StoragePlugin:
        return STORAGES[name]

    @staticmethod
    def write(path: Path, messages: Iterable[Message], storage: str = "mcap") -> Path:
        Ros.fill(Writer(path, version=9, storage_plugin=STORAGES[storage]), messages)
        return path

    @staticmethod
    def fill(writer: Writer, messages: Iterable[Message]) -> None:
        with writer:
            connections: dict[str, Any] = {}
            for topic, kind, arrival_ns, message in messages:
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=TYPES)
                raw = message if isinstance(message, bytes) else TYPES.serialize_cdr(message, kind)
                writer.write(connections[topic], arrival_ns, raw)
