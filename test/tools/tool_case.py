"""What the tests of the command-line tools share: running them as a user does, and reading what they write."""
import json
import os
import subprocess
import unittest


class ToolTest(unittest.TestCase):
    """Names of files are below the test's own folder."""
    folder = ''  # Of the tools.
    work_folder = ''
    timeout_s = 280

    @classmethod
    def tool(cls, name, *words, expect=0):
        """Runs a tool; its exit code must be `expect`. Returns standard output and error."""
        line = [os.path.join(cls.folder, name)] + [str(word) for word in words]
        # Not `text=`, which Python 3.6 does not know.
        done = subprocess.run(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
                              timeout=cls.timeout_s)
        if done.returncode != expect:
            raise AssertionError('%s: exit code %d instead of %d\n%s%s' %
                                 (' '.join(line), done.returncode, expect, done.stdout, done.stderr))
        return done.stdout, done.stderr

    @classmethod
    def work(cls, name):
        return os.path.join(cls.work_folder, name)

    @classmethod
    def report(cls, name):
        with open(cls.work(name)) as file:
            return json.load(file)

    @classmethod
    def make_session(cls, frames):
        """head.nii.gz, and session.bag with two views of it."""
        cls.tool('make_phantom', '--phantom', 'head', '--spacing', 2.5, '--output', cls.work('head.nii.gz'))
        cls.tool('simulate_session', '--ct', cls.work('head.nii.gz'), '--views', 'ap:0,oblique:-50', '--frames', frames,
                 '--size', 128, '--amplitude-deg', 3, '--amplitude-mm', 5, '--output', cls.work('session.bag'))

    def check_is_png(self, name):
        with open(self.work(name), 'rb') as file:
            self.assertEqual(file.read(8), b'\x89PNG\r\n\x1a\n')


def add_folders(parser):
    parser.add_argument('--tools', required=True)
    parser.add_argument('--work', required=True)


def run(case, arguments):
    """Runs the tests of a class; returns the process's exit code."""
    case.folder, case.work_folder = arguments.tools, arguments.work
    os.makedirs(case.work_folder, exist_ok=True)
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromTestCase(case))
    return 0 if result.wasSuccessful() else 1
