"""Writes a ROS 1 bag with Debian's rosbag. Usage: write_ros1_bag.py FILE COMPRESSION

Message i of each topic is made of i by formulas that rosbag1_reference_test.cpp repeats.
"""
import sys

import genpy
import rosbag
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu, NavSatFix, PointCloud2, PointField

COUNT = 40


def stamped(kind, i):
    message = kind()
    message.header.seq = i
    message.header.stamp = genpy.Time(1600000000 + i, 1000 * i)
    message.header.frame_id = f"frame_{i}"
    return message


def imu(i):
    m = stamped(Imu, i)
    m.orientation.w = 1.0 / (i + 1)
    m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z = i / 7, i / 11, i / 13
    m.linear_acceleration.z = 9.81 + i
    m.linear_acceleration_covariance = [float(i + k) for k in range(9)]
    return m


def image(i):
    m = stamped(Image, i)
    m.height, m.width, m.encoding, m.step = 4, 8, "rgb8", 24
    m.data = bytes((i + k) % 256 for k in range(96))
    return m


def compressed(i):
    m = stamped(CompressedImage, i)
    m.format = "jpeg"
    m.data = bytes((3 * i + k) % 256 for k in range(50 + i))
    return m


def info(i):
    m = stamped(CameraInfo, i)
    m.height, m.width, m.distortion_model = 480, 640 + i, "plumb_bob"
    m.D = [0.1 * i, 0.2, 0.3, 0.4, 0.5]
    m.K = [float(i + k) for k in range(9)]
    return m


def fix(i):
    m = stamped(NavSatFix, i)
    m.status.status, m.status.service = 2, 1
    m.latitude, m.longitude, m.altitude = 22.5 + i / 1e6, 114.0 - i / 1e6, 40.0 + i
    return m


def cloud(i):
    m = stamped(PointCloud2, i)
    m.height, m.width, m.point_step, m.row_step, m.is_dense = 1, i, 4, 4 * i, True
    m.fields = [PointField("x", 0, PointField.FLOAT32, 1)]
    m.data = bytes((5 * i + k) % 256 for k in range(4 * i))
    return m


TOPICS = {"/imu": imu, "/image": image, "/image/compressed": compressed, "/info": info, "/fix": fix,
          "/cloud": cloud}

with rosbag.Bag(sys.argv[1], "w", compression=sys.argv[2], chunk_threshold=4096) as bag:
    for i in range(COUNT):
        for topic, make in TOPICS.items():
            bag.write(topic, make(i), genpy.Time(1600000100 + i, 5))
