#!/usr/bin/python3
"""NTP sets a clock, by milliseconds and by seconds: the node's, the camera's, and one after the other."""
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time

import rosbag
import rospy
import rostest
from node_case import NodeCase, tool
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from xray_registration.msg import RegistrationStatus

SLOW_S = 4.0  # So late may an image be on a machine that has a lot to do. Steps by seconds are larger.


class ClockSteps(NodeCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.statuses, cls.transforms, cls.number = {}, [], 0
        cls.make_session()
        cls.set_node(0.0)
        environment = dict(os.environ, LD_PRELOAD=os.environ['SHIFTED_CLOCK'], SHIFTED_CLOCK_FILE=cls.path('node_clock'))
        rospy.Subscriber('/under_test/status', RegistrationStatus, cls.on_status)
        rospy.Subscriber('/tf', TFMessage, cls.on_tf)
        cls.node = subprocess.Popen([tool('xray_registration_node'), '__name:=under_test', 'image_raw:=/front/image_raw'],
                                    env=environment)
        cls.infos = rospy.Publisher('/front/camera_info', CameraInfo, queue_size=5)
        cls.images = rospy.Publisher('/front/image_raw', Image, queue_size=5)
        rospy.wait_for_message('/under_test/ct_surface', rospy.AnyMsg, timeout=200)  # The CT is loaded.

    @classmethod
    def tearDownClass(cls):
        cls.node.send_signal(signal.SIGINT)
        cls.node.wait(timeout=60)
        rospy.delete_param('/under_test')
        cls.folder.cleanup()

    def setUp(self):
        self.until(lambda: self.infos.get_num_connections() and self.images.get_num_connections(), 'nobody subscribes')
        self.camera_ahead_s = 0.0
        self.set_node(0.0)
        self.assertTrue(rospy.ServiceProxy('/under_test/reset', Trigger)().success)  # The initial pose counts again.

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    @classmethod
    def make_session(cls):
        for line in (['make_phantom', '--phantom', 'head', '--spacing', '3', '--output', cls.path('ct.nii.gz')],
                     ['simulate_session', '--ct', cls.path('ct.nii.gz'), '--views', 'front:0', '--frames', '10', '--size',
                      '96', '--amplitude-mm', '1', '--amplitude-deg', '0.5', '--output', cls.path('session.bag')]):
            subprocess.run([tool(line[0])] + line[1:], check=True)
        cls.frames, pose = {}, None
        with rosbag.Bag(cls.path('session.bag')) as bag:
            for topic, message, _ in bag.read_messages(topics=['/front/image_raw', '/front/camera_info',
                                                               '/front/ground_truth']):
                if topic == '/front/ground_truth':
                    pose = pose or message.pose
                else:
                    cls.frames.setdefault(message.header.stamp, {})[topic] = message
        cls.frames = [cls.frames[stamp] for stamp in sorted(cls.frames)]
        start = {'position': [pose.position.x, pose.position.y, pose.position.z],
                 'orientation': [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w]}
        rospy.set_param('/under_test', {'initial_pose': start, 'ct': {'path': cls.path('ct.nii.gz')},
                                        'stamps': {'max_late': SLOW_S, 'max_jump': SLOW_S}})

    @classmethod
    def set_node(cls, ahead_s):
        """What the node's clock is ahead of the true time."""
        descriptor = os.open(cls.path('node_clock'), os.O_WRONLY | os.O_CREAT)
        os.write(descriptor, struct.pack('=q', round(1e9 * ahead_s)))
        os.close(descriptor)

    @classmethod
    def on_status(cls, status):
        cls.statuses[status.header.stamp.to_nsec()] = status

    @classmethod
    def on_tf(cls, message):
        cls.transforms += [one.header.stamp.to_nsec() for one in message.transforms]

    def frame(self):
        """One that is taken now; returns what became of it."""
        frame = self.frames[ClockSteps.number % len(self.frames)]
        ClockSteps.number += 1
        stamp = rospy.Time.from_sec(time.time() + self.camera_ahead_s)
        for topic, publisher in (('/front/camera_info', self.infos), ('/front/image_raw', self.images)):
            frame[topic].header.stamp = stamp
            publisher.publish(frame[topic])
        self.until(lambda: stamp.to_nsec() in self.statuses, 'no status came')
        time.sleep(0.05)
        return self.statuses[stamp.to_nsec()]

    def check_tracked(self, frames=3):
        for _ in range(frames):
            status = self.frame()
            self.assertTrue(status.accepted, status.reason)
            self.assertEqual(status.state, RegistrationStatus.TRACKING)
            self.until(lambda: status.header.stamp.to_nsec() in self.transforms, 'no tf')

    def check_refused(self, word, frames=2):
        for _ in range(frames):
            status = self.frame()
            self.assertFalse(status.accepted)
            self.assertIn(word, status.reason)
            self.assertEqual(status.state, RegistrationStatus.TRACKING)
            self.assertNotIn(status.header.stamp.to_nsec(), self.transforms)

    def test_the_nodes_clock_by_milliseconds(self):
        for ahead_s in (0.0, 0.03, -0.03, 0.2, -0.2, 0.0):
            self.set_node(ahead_s)
            self.check_tracked()

    def test_the_nodes_clock_by_seconds(self):
        self.check_tracked()
        for ahead_s in (10.0, 0.0, 40.0, 30.0, 0.0):
            self.set_node(ahead_s)
            self.check_tracked()
        self.set_node(-10.0)
        self.check_refused("ahead of this node's clock", frames=5)
        self.set_node(0.0)
        self.check_tracked()

    def test_the_cameras_clock_by_milliseconds(self):
        self.check_tracked()
        for ahead_s in (0.03, 0.0, 0.2, 0.0, -0.03, 0.0):
            self.camera_ahead_s = ahead_s
            # What is older than the last one is refused: as many as were taken meanwhile, three at most.
            refused = 0
            while not self.frame().accepted:
                refused += 1
                self.assertLess(refused, 3)
            self.check_tracked()

    def test_the_cameras_clock_by_seconds(self):
        self.check_tracked()
        self.camera_ahead_s = -10.0
        self.check_refused('older than the last one')
        self.check_tracked()
        self.camera_ahead_s = 0.0
        self.check_refused("after the last one's")
        self.check_tracked()

    def test_both_clocks_one_after_the_other(self):
        self.check_tracked()
        self.set_node(-10.0)
        self.check_refused("ahead of this node's clock")
        self.camera_ahead_s = -10.0
        self.check_refused('older than the last one')
        self.check_tracked()


if __name__ == '__main__':
    rospy.init_node('clock_steps_rostest')
    rostest.rosrun('xray_registration', 'clock_steps', ClockSteps, sys.argv)
