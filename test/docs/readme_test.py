#!/usr/bin/python3
"""Runs the commands of README.md as they stand there, with what a newcomer has: a CT, a session, a C-arm's folder, all of
them made here. A block of commands that no case below knows is a failure, so that new ones get one.

usage: readme_test.py --devel FOLDER --work FOLDER    the devel space, in a plain checkout
"""
import argparse
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
README = os.path.join(HERE, '..', '..', 'README.md')
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(HERE, '..', 'tools'))

import calibrate_test  # noqa: E402
import small_dicom  # noqa: E402

BLOCK = re.compile(r'^```sh\n(.*?)^```$', re.MULTILINE | re.DOTALL)
# A launch goes on until it is stopped, a topic is listened to until somebody has seen enough.
PRELUDE = r'''
set -e
. "$DEVEL/setup.bash"
roslaunch() { command roslaunch "$@" > launched.txt 2>&1 & launched=$!; }
rostopic() { timeout 120 rostopic "$@" -n 1 && echo "seen after $SECONDS s"; }
end_launch() {
  # Again and again: roslaunch does not hear it before it has started.
  while [ -n "${launched:-}" ] && kill -INT "$launched" 2> /dev/null; do sleep 2; done
  launched=
}
trap end_launch EXIT
'''
POSE = 'rostopic echo /xray_registration/pose\nend_launch\n'
FRAMES = ['--frames', '8', '--size', '128', '--amplitude-deg', '3', '--amplitude-mm', '5']
BODIES = '''ct: {mask: labels.nii.gz}
views: [ap, lateral]
bodies:
  - {name: skull, label: 1}
  - {name: mandible, label: 2, max_rotation: 0.6, max_translation: 0.05}
'''


def free_port():
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]


def answers(port):
    with socket.socket() as probe:
        return probe.connect_ex(('127.0.0.1', port)) == 0


class ReadmeTest(unittest.TestCase):
    devel, work = '', ''

    @classmethod
    def setUpClass(cls):
        with open(README, encoding='utf-8') as file:
            cls.blocks = BLOCK.findall(file.read())
        cls.seen = set()

    def folder(self, name):
        """A folder of a newcomer's: with ct.nii.gz, and the rest as a case makes it."""
        path = os.path.join(self.work, name)
        os.makedirs(path)
        self.shell('rosrun xray_registration make_phantom --phantom head --spacing 2 --output ct.nii.gz '
                   '--labels labels.nii.gz', path)
        return path

    def block(self, words):
        """The one block that has these words."""
        found = [block for block in self.blocks if words in block]
        self.assertEqual(len(found), 1, words)
        ReadmeTest.seen.add(found[0])
        return found[0]

    def shell(self, commands, path, **environment):
        everything = dict(os.environ, DEVEL=self.devel, PATH='/usr/bin:/bin', **environment)
        said, log = os.path.join(path, 'said.txt'), os.path.join(path, 'launched.txt')
        # Files and not pipes: of what hangs they tell how far it came.
        with open(said, 'w', encoding='utf-8') as file:
            process = subprocess.Popen(['bash', '-c', PRELUDE + commands], cwd=path, env=everything,
                                       stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT,
                                       start_new_session=True)
            try:
                code = process.wait(280)
            except subprocess.TimeoutExpired:
                code = 'none in 280 s'
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        output, launched = (open(name, encoding='utf-8').read() if os.path.exists(name) else '' for name in (said, log))
        self.assertEqual(code, 0, '\n'.join((commands, output, launched)))
        return output

    def simulate(self, path, views, *more, ct='ct.nii.gz'):
        """session.bag, and in start.yaml where its CT is at first."""
        line = ['rosrun xray_registration simulate_session --ct', ct, '--views', views] + FRAMES
        self.shell(' '.join(line + list(more) + ['--output session.bag']), path)
        first = views.split(':')[0]
        self.shell('''command rostopic echo -n 1 -b session.bag /%s/ground_truth/pose > pose.yaml
/usr/bin/python3 -c "
import yaml
pose = next(yaml.safe_load_all(open('pose.yaml')))
yaml.safe_dump({'position': [pose['position'][k] for k in 'xyz'],
                'orientation': [pose['orientation'][k] for k in 'xyzw']}, open('start.yaml', 'w'))"''' % first, path)

    def master(self):
        """A ROS master of this test's own, and the environment that leads to it."""
        port = free_port()
        environment = {'ROS_MASTER_URI': 'http://127.0.0.1:%d' % port, 'ROS_HOSTNAME': '127.0.0.1',
                       'ROS_LOG_DIR': os.path.join(self.work, 'log')}
        process = subprocess.Popen(['bash', '-c', '. "$DEVEL/setup.bash"; exec rosmaster --core -p %d' % port],
                                   env=dict(os.environ, PATH='/usr/bin:/bin', DEVEL=self.devel, **environment),
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        end = time.monotonic() + 60.0
        while not answers(port):
            self.assertLess(time.monotonic(), end, 'rosmaster does not answer')
            time.sleep(0.1)
        return environment

    def test_live(self):
        path = self.folder('live')
        block = self.block('register.launch')
        self.assertIn('. build/devel/setup.bash\n', block)
        environment = self.master()
        # The C-arm: what looks at the CT from the front and sends its images as carm/image_raw.
        carm = subprocess.Popen([os.path.join(self.devel, 'lib/xray_registration/simulator_node'), '_ct/path:=ct.nii.gz',
                                 '_views:=carm:0', '_image_size:=128', '_period:=2', '_rate:=5'], cwd=path,
                                env=dict(os.environ, **environment), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(carm.wait)
        self.addCleanup(carm.terminate)
        block = block.replace('. build/devel/setup.bash\n', '').replace('/data/', path + '/')
        said = self.shell(block + POSE, path, **environment)
        self.assertIn('frames_received', said)
        self.assertIn('covariance', said)

    def test_recording(self):
        path = self.folder('recording')
        self.simulate(path, 'ap:0')
        said = self.shell(self.block('replay.launch') + POSE, path, **self.master())
        self.assertIn('8 of 8 frames accepted', said)
        self.assertIn('covariance', said)
        self.assertEqual(len(os.listdir(os.path.join(path, 'overlays'))), 8)

    def test_dicom(self):
        path = self.folder('dicom')
        self.shell('rosrun xray_registration simulate_session --ct ct.nii.gz --views run:0 --dicom carm ' + ' '.join(FRAMES),
                   path)
        said = self.shell(self.block('dicom_to_bag --inspect'), path)
        self.assertIn('nothing is missing', said)
        self.assertTrue(os.path.exists(os.path.join(path, 'session.bag')))

    def test_calibration_grid(self):
        path = self.folder('grid')
        size = range(calibrate_test.SIZE)
        rows = [[calibrate_test.beads(u, v) // 8 for u in size] for v in size]
        small_dicom.write(os.path.join(path, 'grid.dcm'), rows, {})
        self.shell(self.block('calibrate --grid'), path)
        for name in ('intensifier/grid.png', 'intensifier/undistortion_map.yaml', 'intensifier.json'):
            self.assertTrue(os.path.exists(os.path.join(path, name)), name)

    def test_calibration_with_the_ct(self):
        path = self.folder('calibration')
        self.simulate(path, 'ap:0,oblique:-50')
        self.shell(self.block('calibrate --ct'), path)
        for name in ('ap.yaml', 'oblique.yaml', 'views.launch', 'calibrated.bag', 'residual_motion.png'):
            self.assertTrue(os.path.exists(os.path.join(path, 'calibration', name)), name)

    def test_bodies(self):
        path = self.folder('bodies')
        shutil.copy(os.path.join(path, 'ct.nii.gz'), os.path.join(path, 'thorax.nii.gz'))
        with open(os.path.join(path, 'vertebrae.yaml'), 'w') as file:
            file.write(BODIES)
        self.simulate(path, 'ap:0,lateral:90', '--mask labels.nii.gz --labels skull:1,mandible:2 --joint mandible:10')
        said = self.shell(self.block('--config vertebrae.yaml'), path)
        self.assertIn('8 of 8 frames accepted', said)
        self.assertTrue(os.path.exists(os.path.join(path, 'result.csv')))

    def test_nothing_is_left_out(self):
        # scripts/demo and scripts/test install packages as root; scripts/test runs the former, and this test.
        self.block('scripts/demo ')
        for case in ('register.launch', 'replay.launch', 'dicom_to_bag --inspect', 'calibrate --grid', 'calibrate --ct',
                     '--config vertebrae.yaml'):
            self.block(case)
        self.assertEqual([block for block in self.blocks if block not in self.seen], [])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--devel', required=True)
    parser.add_argument('--work', required=True)
    parser.add_argument('cases', nargs='*', help='these tests only')
    arguments = parser.parse_args()
    ReadmeTest.devel, ReadmeTest.work = os.path.abspath(arguments.devel), os.path.abspath(arguments.work)
    shutil.rmtree(arguments.work, ignore_errors=True)
    os.makedirs(arguments.work)
    load = unittest.defaultTestLoader
    suite = unittest.TestSuite(map(ReadmeTest, arguments.cases)) if arguments.cases else load.loadTestsFromTestCase(ReadmeTest)
    return 0 if unittest.TextTestRunner(verbosity=2).run(suite).wasSuccessful() else 1


if __name__ == '__main__':
    sys.exit(main())
