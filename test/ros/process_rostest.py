#!/usr/bin/python3
"""The node as a process: what it exits with, how long it takes to end, and what it says without a device."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import roslib.packages
import rospy
import rostest
from sensor_msgs.msg import CameraInfo, Image
from xray_registration.msg import RegistrationStatus

# roslaunch sends SIGTERM 15 s after SIGINT.
ROSLAUNCH_PATIENCE = 15.0


class Process(unittest.TestCase):
    def setUp(self):
        self.process = None

    def tearDown(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def start(self, *arguments):
        executable = roslib.packages.find_node("xray_registration", "xray_registration_node")[0]
        self.output = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([executable, "__name:=under_test"] + list(arguments),
                                        stdout=self.output, stderr=subprocess.STDOUT, env=dict(os.environ))

    def text(self):
        self.output.seek(0)
        return self.output.read()

    def image(self):
        image = Image(width=16, height=16, encoding="mono8", step=16, data=bytes(range(256)))
        image.header.stamp = rospy.Time.now()
        image.header.frame_id = "xray"
        info = CameraInfo(width=16, height=16, K=[100, 0, 7.5, 0, 100, 7.5, 0, 0, 1])
        info.header = image.header
        return image, info

    def status_until(self, wanted):
        """Publishes images until a status satisfies `wanted`; returns it, or the last one."""
        received = []
        subscriber = rospy.Subscriber("/under_test/status", RegistrationStatus, received.append)
        images = rospy.Publisher("image_raw", Image, queue_size=5)
        infos = rospy.Publisher("camera_info", CameraInfo, queue_size=5)
        end = time.monotonic() + 30.0
        while time.monotonic() < end and not any(wanted(status) for status in received):
            image, info = self.image()
            infos.publish(info)
            images.publish(image)
            time.sleep(0.1)
        subscriber.unregister()
        found = [status for status in received if wanted(status)]
        self.assertTrue(found, received[-1:] or self.text())
        return found[0]

    def test_wrong_parameter_ends_it_with_the_name(self):
        self.start("_accept/min_similarity:=7")
        self.assertEqual(self.process.wait(timeout=30), 1)
        self.assertIn("accept/min_similarity", self.text())
        self.assertIn("7", self.text())
        rospy.delete_param("/under_test")

    def test_ends_in_time_at_work(self):
        self.start("_ct/path:=/nowhere/ct.nii.gz")
        status = self.status_until(lambda s: s.reason == "no CT is loaded")
        self.assertEqual(status.state, RegistrationStatus.WAITING_FOR_CT)
        self.process.send_signal(signal.SIGINT)
        self.assertEqual(self.process.wait(timeout=ROSLAUNCH_PATIENCE), 0)
        rospy.delete_param("/under_test")

    def test_ends_in_time_while_starting(self):
        self.start()
        time.sleep(0.3)
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=ROSLAUNCH_PATIENCE)

    def test_without_its_device_it_is_a_fault(self):
        self.start("_device:=no such device")
        status = self.status_until(lambda s: s.state == RegistrationStatus.FAULT and "no such device" in s.reason)
        self.assertFalse(status.accepted)
        self.process.send_signal(signal.SIGINT)
        self.assertEqual(self.process.wait(timeout=ROSLAUNCH_PATIENCE), 0)
        rospy.delete_param("/under_test")


if __name__ == "__main__":
    rospy.init_node("process_rostest")
    rostest.rosrun("xray_registration", "process", Process, sys.argv)
