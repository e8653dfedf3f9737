#!/usr/bin/python3
"""The node where memory is short: a CT that does not fit is refused or a fault, never the end of the process."""
import os
import resource
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
from xray_registration.srv import LoadCt, SetInitialPose, SetInitialPoseRequest

LARGE_SIDE = 256
LARGE_BYTES = 2 * LARGE_SIDE ** 3
SMALL_SIDE, SMALL_SPACING_MM = 32, 3.0
# Room left, in sizes of the large CT: too little to read it, to convert it, for its copies on the way to the device, for
# the device's own. Where each ends differs between machines, so the steps are small.
ROOMS = [0.3, 0.8, 1.2, 1.6, 1.9, 2.2, 2.5, 2.8, 3.1, 3.4, 3.8, 4.2, 5.0, 6.0, 9.0]


def write_water(path, side, spacing_mm):
    """A cube of 0 HU; the file is sparse."""
    header = ('ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n'
              'ElementSpacing = %g %g %g\nDimSize = %d %d %d\nElementType = MET_SHORT\nElementDataFile = LOCAL\n' %
              ((spacing_mm,) * 3 + (side,) * 3)).encode()
    with open(path, 'wb') as file:
        file.write(header)
        file.truncate(len(header) + 2 * side ** 3)


class Memory(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.small = os.path.join(self.folder.name, 'small.mha')
        self.large = os.path.join(self.folder.name, 'large.mha')
        write_water(self.small, SMALL_SIDE, SMALL_SPACING_MM)
        write_water(self.large, LARGE_SIDE, 0.5)
        executable = roslib.packages.find_node('xray_registration', 'xray_registration_node')[0]
        self.node = subprocess.Popen([executable, '__name:=limited', '_ct/path:=' + self.small,
                                      '_ct/check_values:=false'])  # Nothing but water.
        self.frames = 0
        self.received = []
        rospy.Subscriber('/limited/status', RegistrationStatus, self.received.append)
        self.images = rospy.Publisher('image_raw', Image, queue_size=5)
        self.infos = rospy.Publisher('camera_info', CameraInfo, queue_size=5)
        rospy.wait_for_service('/limited/load_ct', timeout=60)

    def tearDown(self):
        self.node.kill()
        self.node.wait()
        self.folder.cleanup()

    def check_alive(self):
        self.assertIsNone(self.node.poll(), 'the node ended by itself')

    def publish_frame(self):
        self.frames += 1  # No image is like the one before it.
        pixels = bytes([self.frames % 251]) + bytes((7 * i + 3 * (i // 64)) % 251 for i in range(1, 64 * 64))
        image = Image(width=64, height=64, encoding='mono8', step=64, data=pixels)
        image.header.stamp = rospy.Time.now()
        image.header.frame_id = 'xray'
        info = CameraInfo(width=64, height=64, K=[500, 0, 31.5, 0, 500, 31.5, 0, 0, 1])
        info.header = image.header
        self.infos.publish(info)
        self.images.publish(image)

    def frame_until(self, wanted):
        """Publishes frames until the status of one satisfies `wanted`."""
        del self.received[:]
        end = time.monotonic() + 60.0
        while time.monotonic() < end:
            self.check_alive()
            self.publish_frame()
            time.sleep(0.1)
            for status in list(self.received):
                if wanted(status):
                    return status
        self.fail('no such status; the last one: %s' % self.received[-1:])

    def load(self, path):
        try:
            return rospy.ServiceProxy('/limited/load_ct', LoadCt)(path=path)
        except rospy.ServiceException as error:
            self.node.wait(timeout=30)
            self.fail('the node ended with %s while it loaded a CT: %s' % (self.node.returncode, error))

    def give_pose(self):
        request = SetInitialPoseRequest()
        request.pose.header.frame_id = 'xray'
        request.pose.pose.orientation.w = 1.0
        half_m = 0.5e-3 * SMALL_SIDE * SMALL_SPACING_MM
        request.pose.pose.position.x = request.pose.pose.position.y = -half_m
        request.pose.pose.position.z = 0.6
        answer = rospy.ServiceProxy('/limited/set_initial_pose', SetInitialPose)(request)
        self.assertTrue(answer.success, answer.message)

    def address_space(self):
        with open('/proc/%d/statm' % self.node.pid) as file:
            return int(file.read().split()[0]) * resource.getpagesize()

    def limit(self, limit_bytes):
        resource.prlimit(self.node.pid, resource.RLIMIT_AS, (limit_bytes, resource.RLIM_INFINITY))

    def load_with_room(self, room):
        """Loads the large CT with little room, then the small one with enough. Returns what came of the large one."""
        self.limit(self.address_space() + int(room * LARGE_BYTES))
        answer = self.load(self.large)
        self.give_pose()
        status = self.frame_until(lambda s: s.registered or s.state == RegistrationStatus.FAULT)
        if not answer.success:
            self.assertTrue(answer.message)
        if status.state == RegistrationStatus.FAULT:
            self.assertFalse(status.accepted)
            self.assertTrue(status.reason)
        self.limit(resource.RLIM_INFINITY)
        self.assertTrue(self.load(self.small).success)
        self.give_pose()
        self.frame_until(lambda s: s.registered)
        self.check_alive()
        fault = status.state == RegistrationStatus.FAULT
        return 'loaded' if answer.success else 'fault' if fault else 'refused'

    def test_a_ct_that_does_not_fit_ends_nothing(self):
        self.frame_until(lambda s: s.state == RegistrationStatus.WAITING_FOR_POSE)
        self.give_pose()
        self.frame_until(lambda s: s.registered)
        outcomes = [self.load_with_room(room) for room in ROOMS]
        print(dict(zip(ROOMS, outcomes)))
        self.assertIn('refused', outcomes)
        self.assertIn('fault', outcomes, 'no limit met the upload; ROOMS need smaller steps')


if __name__ == '__main__':
    rospy.init_node('memory_rostest')
    rostest.rosrun('xray_registration', 'memory', Memory, sys.argv)
