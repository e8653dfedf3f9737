#!/usr/bin/python3
"""What rosrun offers: the tools that README.md lists, the nodes, and nothing else; each runs.

usage: rosrun_list_test.py --devel FOLDER    the devel space, in a plain checkout
"""
import argparse
import os
import re
import subprocess
import sys
import unittest

README = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'README.md')
COMPLETION = '/usr/share/bash-completion/completions/rosbash'
# What a person gets with the tab key.
COMPLETE = '. "$DEVEL/setup.bash"; . %s; COMP_WORDS=(rosrun xray_registration ""); COMP_CWORD=2; _roscomplete_exe; ' \
           'printf "%%s\\n" "${COMPREPLY[@]}"' % COMPLETION
# A devel space that was built before: what is not made any more stays there until it is deleted.
OLD = 'if these are left from an earlier build, delete them: '


def shell(line, devel):
    environment = {'PATH': '/usr/bin:/bin', 'HOME': os.environ.get('HOME', '/'), 'DEVEL': devel}
    return subprocess.run(['bash', '-c', line], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, universal_newlines=True, timeout=120)


class RosrunListTest(unittest.TestCase):
    devel = ''

    def offered(self):
        if not os.path.exists(COMPLETION):
            self.skipTest('rosbash is not installed')
        return set(shell(COMPLETE, self.devel).stdout.split())

    def test_it_is_what_the_readme_lists(self):
        with open(README, encoding='utf-8') as file:
            part = file.read().split('### Command-line tools')[1].split('\n#')[0]
        listed = set(re.findall(r'^\| `(\w+)` \|', part, re.MULTILINE))
        self.assertIn('register_bag', listed)
        offered = self.offered() - {'xray_registration_node'}
        # Built only where their libraries are, or not with sanitizers.
        optional = {'kernel_benchmark', 'benchmark', 'evaluate'}
        self.assertEqual(offered - listed, set(), OLD + os.path.join(self.devel, 'lib/xray_registration'))
        self.assertEqual(listed - offered - optional, set())

    def test_each_runs(self):
        # The nodes wait for a master.
        for name in sorted(self.offered() - {'xray_registration_node', 'simulator_node'}):
            done = shell('. "$DEVEL/setup.bash"; rosrun xray_registration %s --help' % name, self.devel)
            self.assertEqual(done.returncode, 0, name + done.stdout + done.stderr)
            self.assertTrue(done.stdout.strip(), name)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--devel', required=True)
    RosrunListTest.devel = os.path.abspath(parser.parse_args().devel)
    result = unittest.TextTestRunner(verbosity=2).run(
        unittest.defaultTestLoader.loadTestsFromTestCase(RosrunListTest))
    return 0 if result.wasSuccessful() else 1


if __name__ == '__main__':
    sys.exit(main())
