#!/usr/bin/python3
"""The node against messages and calls that somebody made to do harm: each frame is refused in one line of plain words,
each call is answered, and the node goes on."""
import io
import os
import random
import re
import struct
import subprocess
import sys
import tempfile
import time
import unittest

import roslib.packages
import rospy
import rostest
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import CameraInfo, Image
from xray_registration.msg import RegistrationStatus
from xray_registration.srv import LoadCt, SetInitialPose, SetInitialPoseRequest

SIDE = 32
NAN = float('nan')
# Orders to a terminal, and a line of a log that nobody wrote.
EVIL = '\x1b[2J\x07\n[ INFO] all is well \u202e'
CONTROL = re.compile('[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e]')


def write_water(path):
    header = ('ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n'
              'ElementSpacing = 3 3 3\nDimSize = %d %d %d\nElementType = MET_SHORT\nElementDataFile = LOCAL\n' %
              ((SIDE,) * 3)).encode()
    with open(path, 'wb') as file:
        file.write(header)
        file.truncate(len(header) + 2 * SIDE ** 3)


def image(**fields):
    message = Image(width=64, height=64, encoding='mono8', step=64)
    message.data = bytes((x * y) % 251 for x in range(64) for y in range(64))
    message.header.frame_id = 'xray'
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def camera_info(**fields):
    message = CameraInfo(width=64, height=64, K=[600, 0, 31.5, 0, 600, 31.5, 0, 0, 1])
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def with_k(place, value):
    k = [600, 0, 31.5, 0, 600, 31.5, 0, 0, 1]
    k[place] = value
    return camera_info(K=k)


def with_roi(x, y, width, height):
    message = camera_info()
    message.roi.x_offset, message.roi.y_offset, message.roi.width, message.roi.height = x, y, width, height
    return message


LARGEST = 2 ** 32 - 1
FRAMES = [
    ('no pixels', image(width=0, height=0, step=0, data=b''), camera_info()),
    ('less data than its size needs', image(data=b'abc'), camera_info()),
    ('a size and a step whose product has no 64 bits left',
     image(width=LARGEST, height=LARGEST, step=LARGEST), camera_info(width=LARGEST, height=LARGEST)),
    ('a height whose rows have no bytes', image(height=2 ** 31, step=0), camera_info(height=2 ** 31)),
    ('a side of 32768', image(width=32768, height=32768, step=32768), camera_info(width=32768, height=32768)),
    ('rows longer than the data', image(step=LARGEST), camera_info()),
    ('an unknown encoding', image(encoding=EVIL), camera_info()),
    ('an encoding of a megabyte', image(encoding='m' * 2 ** 20), camera_info()),
    ('pixels that are no numbers',
     image(encoding='32FC1', step=256, data=struct.pack('<4096f', *(4096 * [NAN]))), camera_info()),
    ('pixels without end', image(encoding='32FC1', step=256,
                                 data=struct.pack('<4096f', *([float('inf')] + 4095 * [1.0]))), camera_info()),
    ('pixels of the largest number', image(encoding='32FC1', step=256,
                                           data=struct.pack('<4096f', *(2048 * [3e38, -3e38]))), camera_info()),
    ('K[0] that is no number', image(), with_k(0, NAN)),
    ('K[2] that is no number', image(), with_k(2, NAN)),
    ('K[0] without end', image(), with_k(0, float('inf'))),
    ('K[0] of 1e300', image(), with_k(0, 1e300)),
    ('K[0] of 1e-300', image(), with_k(0, 1e-300)),
    ('K[2] of 1e300', image(), with_k(2, 1e300)),
    ('a skew', image(), with_k(1, 1e6)),
    ('a million coefficients', image(), camera_info(D=[0.1] * 10 ** 6, distortion_model='plumb_bob')),
    ('a coefficient of 1e300', image(), camera_info(D=[1e300, 0, 0, 0, 0], distortion_model='plumb_bob')),
    ('an unknown model', image(), camera_info(D=[0.1], distortion_model=EVIL)),
    ('binning of 2³²', image(), camera_info(binning_x=LARGEST, binning_y=LARGEST)),
    ('a window beyond the sensor', image(), with_roi(LARGEST, LARGEST, 64, 64)),
    ('a window whose end has no 32 bits left', image(), with_roi(2 ** 31 - 1, 0, 2 ** 31 - 1, 64)),
]


class Hostile(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = os.path.join(cls.temporary.name, 'cts')
        os.makedirs(cls.folder)
        cls.ct = os.path.join(cls.folder, 'water.mha')
        write_water(cls.ct)
        write_water(os.path.join(cls.temporary.name, 'outside.mha'))
        cls.output = tempfile.TemporaryFile('w+', errors='surrogateescape')
        rospy.set_param('/under_test/initial_pose', {'position': [0.0, 0.0, 0.8], 'orientation': [0.0, 0.0, 0.0, 1.0]})
        executable = roslib.packages.find_node('xray_registration', 'xray_registration_node')[0]
        cls.node = subprocess.Popen(
            [executable, '__name:=under_test', '_ct/path:=' + cls.ct, '_ct/directory:=' + cls.folder,
             '_ct/check_values:=false'],
            stdout=cls.output, stderr=subprocess.STDOUT)
        cls.received = []
        rospy.Subscriber('/under_test/status', RegistrationStatus, cls.received.append)
        cls.images = rospy.Publisher('image_raw', Image, queue_size=5)
        cls.infos = rospy.Publisher('camera_info', CameraInfo, queue_size=5)
        cls.poses = rospy.Publisher('initialpose', PoseWithCovarianceStamped, queue_size=5)
        rospy.wait_for_service('/under_test/load_ct', timeout=60)
        cls.stamp = rospy.Time.now()

    @classmethod
    def tearDownClass(cls):
        cls.node.kill()
        cls.node.wait()
        cls.temporary.cleanup()

    def text(self):
        self.output.seek(0)
        return self.output.read()

    def tearDown(self):
        self.assertIsNone(self.node.poll(), 'the node ended by itself\n' + self.text()[-2000:])
        # rosconsole colours lines, but does nothing else to a terminal.
        text = re.sub('\x1b\\[[0-9]*m', '', self.text())
        self.assertIsNone(CONTROL.search(text.replace('\n', '')), repr(text[-2000:]))
        self.assertEqual([line for line in text.splitlines() if line.startswith('[ INFO] all is well')], [])

    def status_of(self, frame, info, renew=None):
        """Publishes a frame until it is answered; `renew` changes it each time."""
        end = time.monotonic() + 90.0
        while time.monotonic() < end:
            if renew is not None:
                renew(frame)
            stamp = rospy.Time.now()
            frame.header.stamp = info.header.stamp = stamp
            info.header.frame_id = frame.header.frame_id
            self.infos.publish(info)
            self.images.publish(frame)
            patience = time.monotonic() + 15.0
            while time.monotonic() < patience:
                found = [status for status in list(self.received) if status.header.stamp == stamp]
                if found:
                    return found[0]
                time.sleep(0.02)
        self.fail('no answer\n' + self.text()[-2000:])

    def check_words(self, words):
        self.assertTrue(words)
        self.assertIsNone(CONTROL.search(words), repr(words))

    def check_alive(self):
        """An honest image is taken as one, once a CT is loaded and the stamps are the usual ones again."""
        def renew(frame):  # The same pixels again would be a held image.
            frame.data = bytes(random.randrange(256) for _ in range(64 * 64))

        end = time.monotonic() + 120.0
        while True:
            status = self.status_of(image(), camera_info(), renew)
            if status.registered:
                return
            self.assertLess(time.monotonic(), end, status.reason)
            time.sleep(0.1)

    def test_frames(self):
        self.check_alive()
        for what, frame, info in FRAMES:
            status = self.status_of(frame, info)
            self.assertFalse(status.accepted, what)
            self.check_words(status.reason)
        self.check_alive()

    def test_names_in_headers(self):
        frame = image()
        frame.header.frame_id = 'xray' + EVIL
        status = self.status_of(frame, camera_info())
        self.assertFalse(status.accepted)
        self.check_words(status.reason)
        self.check_alive()

    def test_bytes_that_are_no_message(self):
        class Raw(Image):
            """Goes by the name of an image."""
            def serialize(self, buff):
                buff.write(self.raw)

        raw = rospy.Publisher('image_raw', Raw, queue_size=5)
        buffer = io.BytesIO()
        image().serialize(buffer)
        whole = buffer.getvalue()
        time.sleep(1.0)
        for content in (b'', b'\xff' * 100, whole[:-1], whole[:20],
                        # Texts and pixels that say that they are longer than the message: 4 GiB, and 200 MB.
                        whole[:12] + b'\xff\xff\xff\xff' + whole[16:],
                        whole[:-4100] + struct.pack('<I', 200000000) + whole[-4096:]):
            message = Raw()
            message.raw = content
            raw.publish(message)
        time.sleep(1.0)
        raw.unregister()
        self.check_alive()

    def test_load_ct(self):
        load = rospy.ServiceProxy('/under_test/load_ct', LoadCt)
        outside = os.path.join(self.temporary.name, 'outside.mha')
        link = os.path.join(self.folder, 'link.mha')
        os.symlink(outside, link)
        for path in (EVIL, self.ct + EVIL, 'x' * 2 ** 20, '/etc/passwd', '/dev/zero', '/proc/self/mem', outside, link,
                     self.folder + '/../outside.mha', self.ct + '\0', '/etc/passwd\0' + self.ct, self.folder, '~', '-'):
            answer = load(path, EVIL)
            self.assertFalse(answer.success, path[:100])
            self.check_words(answer.message)
        end = time.monotonic() + 90.0
        answer = load(self.ct, '')
        while not answer.success and 'being loaded' in answer.message and time.monotonic() < end:
            answer = load(self.ct, '')
        self.assertTrue(answer.success, answer.message)
        self.check_alive()

    def test_poses(self):
        self.check_alive()  # Whose frame a start is in can be looked up from here on.
        call = rospy.ServiceProxy('/under_test/set_initial_pose', SetInitialPose)
        for frame, body, numbers in ((EVIL, '', (0, 0, 0, 1)), ('xray', EVIL, (0, 0, 0, 1)), ('xray', '', (0, 0, 0, 0)),
                                     ('xray', '', (NAN, 0, 0, 1)), ('xray', 'b' * 2 ** 20, (0, 0, 0, 1)),
                                     ('', '', (0, 0, 0, 1)), ('xray', '', (1e300, 0, 0, 1))):
            request = SetInitialPoseRequest()
            request.pose.header.frame_id, request.body = frame, body
            orientation = request.pose.pose.orientation
            orientation.x, orientation.y, orientation.z, orientation.w = numbers
            answer = call(request)
            self.check_words(answer.message)
            self.assertFalse(answer.success, request.pose if len(body) < 100 else 'long')
            message = PoseWithCovarianceStamped()
            message.header.frame_id = frame
            message.pose.pose = request.pose.pose
            self.poses.publish(message)
        far = SetInitialPoseRequest()
        far.pose.header.frame_id = 'xray'
        far.pose.pose.orientation.w = 1.0
        far.pose.pose.position.z = 1e300
        self.check_words(call(far).message)
        self.status_of(image(), camera_info())
        far.pose.pose.position.z = 0.8
        self.assertTrue(call(far).success)
        self.check_alive()


if __name__ == '__main__':
    rospy.init_node('hostile_rostest')
    rostest.rosrun('xray_registration', 'hostile', Hostile, sys.argv)
