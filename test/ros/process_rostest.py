#!/usr/bin/python3
"""The node as a process: what it exits with, how long it takes to end, and what it says without a device."""
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import xmlrpc.client

import roslib.packages
import rospy
import rostest
from sensor_msgs.msg import CameraInfo, Image
from xray_registration.msg import RegistrationStatus

# roslaunch sends SIGTERM 15 s after SIGINT.
ROSLAUNCH_PATIENCE = 15.0
POSE = {'position': [0.0, 0.0, 1.0], 'orientation': [0.0, 0.0, 0.0, 1.0]}


class Process(unittest.TestCase):
    def setUp(self):
        self.process = None

    def tearDown(self):
        if self.process is not None and self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def start(self, *arguments):
        executable = roslib.packages.find_node("xray_registration", "xray_registration_node")[0]
        self.run_process([executable, "__name:=under_test"] + list(arguments))

    def run_process(self, line, environment=None):
        self.output = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(line, stdout=self.output, stderr=subprocess.STDOUT,
                                        env=environment or dict(os.environ))

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

    # What cannot be: below which name, with which value, and what its one line must hold beside these.
    WRONG = [
        ({'accept/min_similarity': 7}, ['accept/min_similarity', "'7'", '-1 to 1']),
        ({'initial_pose': dict(POSE, frame='room')}, ['initial_pose/frame', 'room', 'frame_id']),
        ({'initial_pose': dict(POSE, frame_id=['a', 'b'])}, ['initial_pose/frame_id', '[a, b]', 'a text']),
        ({'initial_pose': {'position': [1, 2], 'orientation': [0, 0, 0, 1]}}, ['initial_pose', '[1, 2]', 'metres']),
        ({'views': ['1ap']}, ['views', '1ap', 'a letter']),
        ({'views': ['_x']}, ['views', '_x', 'a letter']),
        ({'views': [1, 2]}, ['views', "'1'", 'a letter']),
        ({'image_transport': 'no_such_transport'}, ['image_transport', 'no_such_transport', 'raw']),
        ({'image/mask': '/nowhere/mask.png'}, ['image/mask', '/nowhere/mask.png', 'PNG']),
        ({'image/undistortion_map': '/nowhere/map.yaml'}, ['image/undistortion_map', '/nowhere/map.yaml', 'no such file']),
        ({'ct': 3}, ['ct', "'3'", 'group']),
    ]

    def set_parameters(self, parameters):
        for name, value in parameters.items():
            rospy.set_param('/under_test/' + name, value)

    def check_fatal_line(self, words):
        lines = [line for line in self.text().splitlines() if 'FATAL' in line]
        self.assertEqual(len(lines), 1, self.text())
        for word in words:
            self.assertIn(word, lines[0])

    def test_wrong_parameters_end_it_with_one_line(self):
        for parameters, words in self.WRONG:
            self.set_parameters(parameters)
            self.start()
            self.assertEqual(self.process.wait(timeout=30), 1, '%s: %s' % (parameters, self.text()))
            self.check_fatal_line(words)
            rospy.delete_param('/under_test')

    def test_whatever_is_thrown_ends_it_with_one_line(self):
        self.start('image_raw:=1image')
        self.assertEqual(self.process.wait(timeout=30), 1, self.text())
        self.check_fatal_line(['1image'])

    def test_wrong_parameter_of_a_nodelet_leaves_its_manager(self):
        nodelet = roslib.packages.find_node('nodelet', 'nodelet')[0]
        # As in nodelet.test: a sanitizer's runtime goes first.
        prefix = os.environ.get('XRAY_REGISTRATION_NODELET_PREFIX', '').split()
        load = [nodelet, 'load', 'xray_registration/RegistrationNodelet', 'manager', '__name:=under_test']
        self.run_process(prefix + [nodelet, 'manager', '__name:=manager'])
        for parameters, words in ({'views': ['1ap']}, ['views', '1ap', 'a letter']), ({'ct': 3}, ['ct', 'group']):
            self.set_parameters(parameters)
            before = len(self.text())
            self.assertNotEqual(subprocess.run(load, timeout=60, stdout=subprocess.DEVNULL,
                                               stderr=subprocess.DEVNULL).returncode, 0)
            fatal = [line for line in self.text()[before:].splitlines() if 'FATAL' in line]
            self.assertEqual(len(fatal), 1, self.text())
            for word in words:
                self.assertIn(word, fatal[0])
            rospy.delete_param('/under_test')
        self.assertIsNone(self.process.poll(), self.text())
        loader = subprocess.Popen(load, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self.status_until(lambda s: s.reason == 'no CT is loaded')
        finally:
            loader.send_signal(signal.SIGINT)  # It unloads the nodelet.
            loader.wait(timeout=ROSLAUNCH_PATIENCE)

    def test_ends_in_time_at_work(self):
        for ends_it in (signal.SIGINT, signal.SIGTERM):
            self.start("_ct/path:=/nowhere/ct.nii.gz")
            status = self.status_until(lambda s: s.reason == "no CT is loaded")
            self.assertEqual(status.state, RegistrationStatus.WAITING_FOR_CT)
            self.assertFalse(status.accepted or status.registered)
            self.process.send_signal(ends_it)
            self.assertEqual(self.process.wait(timeout=ROSLAUNCH_PATIENCE), 0, ends_it)
            rospy.delete_param("/under_test")

    def start_master(self, port):
        master = subprocess.Popen(['rosmaster', '--core', '-p', str(port)], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.DEVNULL)
        self.addCleanup(lambda: (master.kill(), master.wait()))
        return master

    def registered(self, port):
        """What the master on a port knows of the node: published topics, subscribed ones, services."""
        try:
            state = xmlrpc.client.ServerProxy('http://localhost:%d' % port).getSystemState('/test')[2]
        except (OSError, xmlrpc.client.Error):
            return None
        return [{name for name, nodes in kind if '/under_test' in nodes} for kind in state]

    def until(self, condition, what):
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            found = condition()
            if found:
                return found
            time.sleep(0.1)
        self.fail(what + '\n' + self.text())

    def test_master_that_dies_and_comes_back(self):
        with socket.socket() as free:
            free.bind(('', 0))
            port = free.getsockname()[1]
        environment = dict(os.environ, ROS_MASTER_URI='http://localhost:%d' % port)
        master = self.start_master(port)
        self.until(lambda: self.registered(port) is not None, 'no master')
        executable = roslib.packages.find_node('xray_registration', 'xray_registration_node')[0]
        self.run_process([executable, '__name:=under_test'], environment)
        # Images are what it subscribes to last.
        self.until(lambda: '/image_raw' in self.registered(port)[1], 'the node did not start')
        before = self.registered(port)
        for name, kind in (('/under_test/status', 0), ('/camera_info', 1), ('/under_test/accept/set_parameters', 2)):
            self.assertIn(name, before[kind])
        time.sleep(2.0)  # The node has looked at the master, and knows what it has there.
        master.kill()
        master.wait()
        self.until(lambda: 'does not answer' in self.text(), 'the node did not say that the master is gone')
        self.start_master(port)
        self.until(lambda: 'the ROS master is back' in self.text(), 'the node did not say that the master is back')
        self.assertEqual(self.registered(port), before)
        # Who comes now finds the node, and is found: an image goes in, and a status comes out.
        camera = subprocess.Popen(
            ['rostopic', 'pub', '-r', '5', '/image_raw', 'sensor_msgs/Image',
             '{header: auto, height: 1, width: 1, encoding: mono8, step: 1, data: [7]}'], env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(lambda: (camera.kill(), camera.wait()))
        status = subprocess.run(['rostopic', 'echo', '-n', '1', '/under_test/status/reason'], env=environment, timeout=60,
                                stdout=subprocess.PIPE, universal_newlines=True)
        self.assertRegex(status.stdout, 'no CT is loaded|stamp was already handled')  # rostopic repeats its stamp.
        self.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.process.wait(timeout=ROSLAUNCH_PATIENCE), 0)

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
