#!/usr/bin/python3
"""register_bag and the node say the same of the same frames, to the last bit, when none is dropped."""
import json
import os
import subprocess
import sys
import tempfile
import time

import rosbag
import rospy
import rostest
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from node_case import NodeCase, tool
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from xray_registration.msg import RegistrationStatus

FRAMES, RATE = 34, 10.0
# What is spoilt of the session: by these frames' numbers.
BLACK = [6]
HELD = [10, 11]
ALL_BLACK = range(15, 21)  # More than tracking/frames_until_lost.
PAUSE_BEFORE, PAUSE_S = 27, 5.5  # Longer than health/pose_age_error.
# Of a status, all but times and counts of the node.
COMPARED = ['accepted', 'converged', 'iterations', 'similarity', 'residual', 'inlier_fraction', 'condition_number',
            'registered', 'pose', 'views_used', 'views_missing', 'bodies', 'suspicions', 'state', 'ct', 'device']


def numbers(message):
    """A message's fields as text: equal texts are equal bits, as Python writes a double with all its digits."""
    return str(message)


class Answers:
    """What was said of each frame: by stamp."""

    def __init__(self):
        self.poses, self.statuses, self.transforms = {}, {}, {}

    def add(self, topic, message):
        if topic.endswith('/pose'):
            self.poses[message.header.stamp] = message
        elif topic.endswith('/status'):
            self.statuses[message.header.stamp] = message
        elif topic == '/tf':
            for transform in message.transforms:
                self.transforms[transform.header.stamp] = transform


class Agreement(NodeCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.node = None

    def tearDown(self):
        if self.node is not None and self.node.poll() is None:
            self.node.kill()
            self.node.wait()
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_tool(self, name, *words):
        done = subprocess.run([tool(name)] + list(words), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              universal_newlines=True)
        self.assertEqual(done.returncode, 0, done.stdout)

    def make_session(self, views):
        """A CT and a bag with frames of all kinds. Returns the start of the CT, off by some millimetres."""
        self.run_tool('make_phantom', '--phantom', 'head', '--spacing', '3', '--output', self.path('ct.nii.gz'))
        self.run_tool('simulate_session', '--ct', self.path('ct.nii.gz'), '--views', views, '--frames', str(FRAMES),
                      '--rate', str(RATE), '--size', '96', '--amplitude-mm', '4', '--amplitude-deg', '2', '--output',
                      self.path('whole.bag'))
        start, numbers_of, last = None, {}, {}
        with rosbag.Bag(self.path('whole.bag')) as whole, rosbag.Bag(self.path('session.bag'), 'w') as spoilt:
            for topic, message, at in whole.read_messages():
                if topic == '/tf_static':
                    spoilt.write(topic, message, at)
                    continue
                number = numbers_of.setdefault(message.header.stamp.to_nsec(), len(numbers_of))
                if topic.endswith('/ground_truth'):
                    start = start or message.pose
                    continue
                if number >= PAUSE_BEFORE:
                    message.header.stamp += rospy.Duration(PAUSE_S)
                if topic.endswith('/image_raw'):
                    if number in BLACK or number in ALL_BLACK:
                        message.data = bytes([number, 0]) + bytes(len(message.data) - 2)  # None is held.
                    elif number in HELD:
                        message.data = last[topic]
                    last[topic] = message.data
                spoilt.write(topic, message, at + rospy.Duration(PAUSE_S if number >= PAUSE_BEFORE else 0.0))
        position, turn = start.position, start.orientation
        return {'position': [position.x + 0.0021, position.y - 0.0013, position.z + 0.0017],
                'orientation': [turn.x, turn.y, turn.z, turn.w]}

    def offline(self, config, views):
        self.run_tool('register_bag', '--ct', self.path('ct.nii.gz'), '--bag', self.path('session.bag'), '--config',
                      self.path('config.yaml'), '--views', ','.join(views), '--output', self.path('offline.bag'), '--json',
                      self.path('offline.json'))
        answers = Answers()
        with rosbag.Bag(self.path('offline.bag')) as bag:
            for topic, message, _ in bag.read_messages():
                answers.add(topic, message)
        with open(self.path('offline.json')) as file:
            frames = json.load(file)['frames']
        for frame, stamp in zip(frames, sorted(answers.statuses)):  # The file says what the bag holds.
            self.assertEqual(frame['stamp'], stamp.to_sec())
            self.assertEqual(frame['similarity'], answers.statuses[stamp].similarity)
        return answers

    def online(self, config, views):
        """Each frame when the one before it was answered."""
        answers = Answers()
        subscribers = [rospy.Subscriber(topic, kind, lambda message, topic=topic: answers.add(topic, message))
                       for topic, kind in (('/under_test/pose', PoseWithCovarianceStamped),
                                           ('/under_test/status', RegistrationStatus), ('/tf', TFMessage))]
        statics = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
        rospy.set_param('/under_test', dict(config, ct={'path': self.path('ct.nii.gz')}))
        self.node = subprocess.Popen([tool('xray_registration_node'), '__name:=under_test'])
        surface = rospy.wait_for_message('/under_test/ct_surface', rospy.AnyMsg, timeout=200)  # The CT is loaded.
        self.assertTrue(surface)
        publishers = {}
        for view in views:
            publishers['/%s/camera_info' % view] = rospy.Publisher('/%s/camera_info' % view, CameraInfo, queue_size=5)
            publishers['/%s/image_raw' % view] = rospy.Publisher('/%s/image_raw' % view, Image, queue_size=5)
        self.until(lambda: all(one.get_num_connections() for one in publishers.values()), 'the node does not subscribe')
        before = None
        with rosbag.Bag(self.path('session.bag')) as bag:
            for topic, message, _ in bag.read_messages():
                if topic == '/tf_static':
                    statics.publish(message)
                    self.until(lambda: statics.get_num_connections(), 'nobody hears of the views')
                    time.sleep(0.5)
            frames = {}
            for topic, message, _ in bag.read_messages(topics=list(publishers)):
                frames.setdefault(message.header.stamp, []).append((topic, message))
        for stamp in sorted(frames):
            if before and (stamp - before).to_sec() > 1.0:
                time.sleep((stamp - before).to_sec())
            before = stamp
            for topic, message in sorted(frames[stamp], key=lambda one: one[0]):
                publishers[topic].publish(message)
            self.until(lambda: stamp in answers.statuses, 'no status of %s' % stamp)
            status = answers.statuses[stamp]
            self.until(lambda: not status.accepted or (stamp in answers.poses and stamp in answers.transforms), 'no pose')
        for subscriber in subscribers:
            subscriber.unregister()
        rospy.delete_param('/under_test')
        return answers

    def check(self, views):
        names = [name for name, _ in views]
        start = self.make_session(','.join('%s:%d' % view for view in views))
        config = {'initial_pose': start, 'views': names}
        with open(self.path('config.yaml'), 'w') as file:
            yaml.safe_dump(config, file)
        offline, online = self.offline(config, names), self.online(config, names)
        self.assertEqual(len(offline.statuses), FRAMES)
        self.assertEqual(sorted(offline.statuses), sorted(online.statuses))
        states = []
        for number, stamp in enumerate(sorted(offline.statuses)):
            one, other = offline.statuses[stamp], online.statuses[stamp]
            states.append(other.state)
            if number not in HELD:  # Since when it is held is said by the stamps, and by the clock.
                self.assertEqual(one.reason, other.reason)
            for name in COMPARED:
                self.assertEqual(numbers(getattr(one, name)), numbers(getattr(other, name)),
                                 'frame %d, %s; offline: %s; online: %s' % (number, name, one.reason, other.reason))
        self.assertEqual(sorted(offline.poses), sorted(online.poses))
        for stamp, pose in offline.poses.items():
            self.assertEqual(numbers(pose.pose), numbers(online.poses[stamp].pose))
            self.assertEqual(pose.header.frame_id, online.poses[stamp].header.frame_id)
            self.assertEqual(numbers(offline.transforms[stamp].transform), numbers(online.transforms[stamp].transform))
        # All that was to happen did.
        unusable = len(BLACK) + len(HELD) + len(ALL_BLACK)
        self.assertEqual(len(online.poses), FRAMES - unusable)
        self.assertEqual(states[BLACK[0]], RegistrationStatus.TRACKING)
        self.assertEqual(states[ALL_BLACK[-1]], RegistrationStatus.LOST)
        self.assertEqual(states[-1], RegistrationStatus.TRACKING)

    def test_one_view(self):
        self.check([('front', 0)])

    def test_two_views(self):
        self.check([('front', 0), ('side', 90)])


if __name__ == '__main__':
    rospy.init_node('agreement_rostest')
    rostest.rosrun('xray_registration', 'agreement', Agreement, sys.argv)
