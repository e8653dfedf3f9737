#!/usr/bin/python3
"""What a person does at the console: every topic and service that the node offers is shown and called by ROS's own
commands, and its pictures are looked at without rviz."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import rosgraph
import roslib.packages
import rospy
import rostest
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped
from std_srvs.srv import Trigger

NODE = '/registration'
PARAMETERS = {
    'image': {'find_metal': False},
    'initial_pose': {'position': [0.0, 0.05, 0.82], 'orientation': [0.7071, 0.0, 0.0, 0.7071]},
    'calibration': {'frames': 0},  # ~calibrate answers at once.
    'bodies': [{'name': 'mandible', 'label': 2, 'max_rotation': 0.1, 'max_translation': 0.01}],
}
# Another python3 earlier in PATH would have no ROS modules.
ENVIRONMENT = dict(os.environ, PATH='/usr/bin:/bin')
# Topics that are silent until somebody asks for something: there only the kind of message is looked at.
ON_REQUEST = re.compile(r'/(localize/(goal|feedback|result)|preview(_drr)?(/\w+)?|landmarks|ct_marker/update(_full)?)$')
ASKED = {'set_enabled': '{data: true}', 'set_logger_level': '{logger: ros.xray_registration, level: info}'}


def tool(package, name):
    return roslib.packages.find_node(package, name)[0]


def console(*words, seconds=90):
    return subprocess.run(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True, timeout=seconds, env=ENVIRONMENT)


class Console(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        ct, labels = os.path.join(cls.folder, 'ct.nii.gz'), os.path.join(cls.folder, 'labels.nii.gz')
        subprocess.check_call([tool('xray_registration', 'make_phantom'), '--phantom', 'head', '--spacing', '2',
                               '--output', ct, '--labels', labels])
        rospy.set_param(NODE, dict(PARAMETERS, ct={'path': ct, 'mask': labels}))
        cls.node = subprocess.Popen([tool('xray_registration', 'xray_registration_node'), '__name:=registration',
                                     'image_raw:=ap/image_raw'])
        rospy.wait_for_message(NODE + '/pose', PoseWithCovarianceStamped, timeout=120)
        cls.reset = rospy.ServiceProxy(NODE + '/reset', Trigger)

    @classmethod
    def tearDownClass(cls):
        cls.node.terminate()
        cls.node.wait()
        shutil.rmtree(cls.folder)

    def offered(self, kind):
        """Names of topics (0) or services (2) of the node, from the master."""
        state = rosgraph.Master('/console').getSystemState()[kind]
        return sorted(name for name, nodes in state if NODE in nodes)

    def keep_talking(self):
        """Something for /rosout, and for whoever waits for a pose, until the test ends."""
        done = threading.Event()

        def talk():
            while not done.wait(15.0):
                self.reset()
        thread = threading.Thread(target=talk)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(done.set)

    def test_every_topic_is_shown(self):
        self.keep_talking()
        topics = self.offered(0)
        for name in ('/tf', '/diagnostics', NODE + '/pose', NODE + '/status', NODE + '/overlay', NODE + '/drr',
                     NODE + '/ct_surface', NODE + '/bodies/mandible/surface', NODE + '/bodies/mandible/pose',
                     NODE + '/accept/parameter_updates'):
            self.assertIn(name, topics)
        for topic in topics:
            kind = console('rostopic', 'type', topic)
            self.assertEqual(kind.returncode, 0, topic + kind.stdout)
            shown = console('rosmsg', 'show', kind.stdout.strip())
            self.assertEqual(shown.returncode, 0, topic + shown.stdout)
            if ON_REQUEST.search(topic):
                continue
            echo = console('rostopic', 'echo', '--noarr', '-n', '1', topic)
            self.assertEqual(echo.returncode, 0, topic + echo.stdout)
            self.assertIn('---', echo.stdout, topic)
            self.assertNotIn('ERROR', echo.stdout.split('---')[-1], topic)

    def test_every_service_is_called(self):
        services = self.offered(2)
        for name in ('load_ct', 'set_initial_pose', 'calibrate', 'reset', 'set_enabled', 'register_once',
                     'accept/set_parameters'):
            self.assertIn(NODE + '/' + name, services)
        # With nothing asked for, which says no or does no harm, but where that would switch off or be an error.
        for service in services:
            kind = console('rosservice', 'type', service)
            self.assertEqual(kind.returncode, 0, service + kind.stdout)
            called = console('rosservice', 'call', service, ASKED.get(service.split('/')[-1], '{}'), seconds=150)
            self.assertEqual(called.returncode, 0, service + called.stdout)
            self.assertNotIn('ERROR', called.stdout, service)
        # What is logged afterwards, from places that have not been logged from yet, is still logged.
        loggers = yaml.safe_load(console('rosservice', 'call', NODE + '/get_loggers').stdout)['loggers']
        self.assertIn({'name': 'ros.xray_registration', 'level': 'info'}, loggers)
        answer = yaml.safe_load(console('rosservice', 'call', NODE + '/reset').stdout)
        self.assertTrue(answer['success'])

    def test_live_parameters_are_shown_and_set(self):
        read = console('rosrun', 'dynamic_reconfigure', 'dynparam', 'get', NODE + '/solver')
        self.assertEqual(read.returncode, 0, read.stdout)
        self.assertIn('local_normalised', read.stdout)
        done = console('rosrun', 'dynamic_reconfigure', 'dynparam', 'set', NODE + '/solver', 'search_poses', '97')
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertEqual(rospy.get_param(NODE + '/solver/search_poses'), 97)

    def launch(self, *words):
        """A launch below a display in memory, or without one where there is none."""
        xvfb = shutil.which('xvfb-run')
        process = subprocess.Popen(([xvfb, '-a'] if xvfb else []) + ['roslaunch', 'xray_registration'] + list(words),
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                                   env=ENVIRONMENT)

        def end():
            for node in ('/show_overlay', '/show_drr'):
                console('rosnode', 'kill', node)
            process.communicate(timeout=60)
        self.addCleanup(end)

    @unittest.skipUnless(shutil.which('xvfb-run'), 'SKIPPED: no display in memory (xvfb) for view.launch')
    def test_pictures_without_rviz(self):
        self.launch('view.launch', 'name:=registration')
        wanted = {('/show_overlay', NODE + '/overlay'), ('/show_drr', NODE + '/drr')}
        subscribed = set()
        end = time.monotonic() + 60.0
        while time.monotonic() < end and not wanted <= subscribed:
            time.sleep(0.5)
            state = rosgraph.Master('/console').getSystemState()[1]
            subscribed = {(node, topic) for topic, nodes in state for node in nodes}
        self.assertLessEqual(wanted, subscribed)
        time.sleep(3.0)  # A viewer that cannot show what comes is gone by now.
        for node in ('/show_overlay', '/show_drr'):
            ping = console('rosnode', 'ping', '-c', '1', node)
            self.assertIn('xmlrpc reply', ping.stdout)

    def test_a_viewer_that_is_missing_is_named(self):
        viewer = tool('xray_registration', 'start_viewer')
        with tempfile.TemporaryDirectory() as bare:
            for name in ('sh', 'sed', 'echo', 'tr'):
                os.symlink(shutil.which(name), os.path.join(bare, name))
            for package, install in ('rviz', 'rviz'), ('image_view', 'ros-image-view libimage-view-dev'):
                done = subprocess.run([viewer, package, package], env={'PATH': bare}, stdout=subprocess.PIPE,
                                      stderr=subprocess.STDOUT, universal_newlines=True)
                self.assertEqual(done.returncode, 1)
                self.assertIn('%s is not installed' % package, done.stdout)
                self.assertIn("'sudo apt-get install %s'" % install, done.stdout)


if __name__ == '__main__':
    rospy.init_node('console')
    rostest.rosrun('xray_registration', 'console', Console, sys.argv)
