#!/usr/bin/python3
"""Runs every command of docs/tutorial_dicom.md, in its order, and looks for the output that it shows.

usage: tutorial_dicom_test.py --tools FOLDER --work FOLDER
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import unittest

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'docs', 'tutorial_dicom.md')
BLOCK = re.compile(r'^```(sh|text)\n(.*?)^```$', re.MULTILINE | re.DOTALL)
# rosrun looks in the workspace that is sourced; these are the tools that were just built.
ROSRUN = 'rosrun() { local tool=$2; shift 2; "$TOOLS/$tool" "$@"; }\nset -e\n'


class TutorialTest(unittest.TestCase):
    tools, work = '', ''

    def test_every_command_does_what_the_page_shows(self):
        with open(PAGE, encoding='utf-8') as file:
            blocks = BLOCK.findall(file.read())
        self.assertGreaterEqual(sum(kind == 'sh' for kind, _ in blocks), 4)
        self.assertGreaterEqual(sum(kind == 'text' for kind, _ in blocks), 2)
        output = ''
        for kind, text in blocks:
            if kind == 'sh':
                output = self.run_commands(text)
                continue
            for line in text.splitlines():
                self.assertIn(line, output)

    def run_commands(self, text):
        done = subprocess.run(['bash', '-c', ROSRUN + text], cwd=self.work, env=dict(os.environ, TOOLS=self.tools),
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
        self.assertEqual(done.returncode, 0, text + done.stdout + done.stderr)
        return done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--tools', required=True)
    parser.add_argument('--work', required=True)
    arguments = parser.parse_args()
    TutorialTest.tools, TutorialTest.work = os.path.abspath(arguments.tools), arguments.work
    shutil.rmtree(arguments.work, ignore_errors=True)
    os.makedirs(arguments.work)
    result = unittest.TextTestRunner(verbosity=2).run(unittest.defaultTestLoader.loadTestsFromTestCase(TutorialTest))
    return 0 if result.wasSuccessful() else 1


if __name__ == '__main__':
    sys.exit(main())
