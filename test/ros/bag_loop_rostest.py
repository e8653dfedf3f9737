#!/usr/bin/python3
"""A bag that rosbag plays in a loop, with and without --clock: docs/stamps_and_clocks.md."""
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import roslib.packages
import rosbag
import rospy
import rostest
from xray_registration.msg import RegistrationStatus

RATE = 10.0
LOOPS = 4


def tool(name):
    return roslib.packages.find_node('xray_registration', name)[0]


class BagLoop(unittest.TestCase):
    def setUp(self):
        self.folder, self.processes = tempfile.TemporaryDirectory(), []
        self.statuses = []

    def tearDown(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait(timeout=60)
        rospy.delete_param('/under_test')
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def start(self, *line):
        self.processes.append(subprocess.Popen(line))
        return self.processes[-1]

    def make_session(self, frames):
        """Returns a start of the CT, exact: what is asked here is not where it is found from."""
        subprocess.run([tool('make_phantom'), '--phantom', 'head', '--spacing', '3', '--output', self.path('ct.nii.gz')],
                       check=True)
        subprocess.run([tool('simulate_session'), '--ct', self.path('ct.nii.gz'), '--views', 'front:0', '--frames',
                        str(frames), '--rate', str(RATE), '--size', '96', '--amplitude-mm', '3', '--amplitude-deg', '1',
                        '--output', self.path('session.bag')], check=True)
        with rosbag.Bag(self.path('session.bag')) as bag:
            pose = next(iter(bag.read_messages(topics=['/front/ground_truth'])))[1].pose
        return {'position': [pose.position.x, pose.position.y, pose.position.z],
                'orientation': [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w]}

    def play(self, frames, clock):
        """Plays until the bag began LOOPS times, as the statuses show."""
        rospy.set_param('/use_sim_time', clock)
        rospy.set_param('/under_test', {'initial_pose': self.make_session(frames), 'ct': {'path': self.path('ct.nii.gz')}})
        subscriber = rospy.Subscriber('/under_test/status', RegistrationStatus, self.statuses.append)
        node = self.start(tool('xray_registration_node'), '__name:=under_test', 'image_raw:=/front/image_raw')
        rospy.wait_for_message('/under_test/ct_surface', rospy.AnyMsg, timeout=200)  # The CT is loaded.
        self.start('rosbag', 'play', '--quiet', '--loop', *(['--clock'] if clock else []), self.path('session.bag'))
        end = time.monotonic() + 120.0
        while sum(len(loop) >= 3 for loop in self.loops()) < LOOPS:  # In some the node follows the CT.
            self.assertIsNone(node.poll(), 'the node ended by itself')
            self.assertLess(time.monotonic(), end, [s.reason for s in self.statuses[-20:]])
            time.sleep(0.1)
        subscriber.unregister()

    def loops(self):
        """What was accepted, cut where the stamps go back. The node may be busy until the end of a short one."""
        loops, last = [], None
        for status in list(self.statuses):
            if not status.accepted:
                continue
            if last is None or status.header.stamp < last:
                loops.append([])
            loops[-1].append(status)
            last = status.header.stamp
        return loops

    def test_without_a_clock_it_goes_on(self):
        self.play(20, clock=False)
        tracking = [s.accepted for s in self.statuses].index(True)  # A kernel that is built first takes its time.
        begun = sum(s.header.stamp == min(one.header.stamp for one in self.statuses) for s in self.statuses)
        refused = [s.reason for s in self.statuses[tracking:] if not s.accepted and not s.reason.startswith('dropped')]
        self.assertLessEqual(len(refused), 2 * begun)
        for reason in refused:
            self.assertIn('older than the last one', reason)
        for status in self.statuses[tracking:]:
            self.assertEqual(status.state, RegistrationStatus.TRACKING, status.reason)
            self.assertLess(status.latency, 60.0)

    def check_new_recordings(self, frames):
        self.play(frames, clock=True)
        loops = self.loops()
        followed = min(status.iterations for loop in loops for status in loop[1:])
        for loop in loops:
            # Nothing is left of the loop before: the first one is searched for, which takes more steps than following.
            self.assertGreater(loop[0].iterations, followed)
        for status in self.statuses:
            self.assertNotEqual(status.state, RegistrationStatus.LOST, status.reason)

    def test_with_a_clock_each_loop_is_a_new_recording(self):
        self.check_new_recordings(20)

    def test_with_a_clock_a_clip_shorter_than_a_second_is_one_too(self):
        self.check_new_recordings(8)


if __name__ == '__main__':
    rospy.init_node('bag_loop_rostest')
    rostest.rosrun('xray_registration', 'bag_loop', BagLoop, sys.argv)
