"""What the node tests that start a node of their own share."""
import time
import unittest

import roslib.packages


def tool(name):
    return roslib.packages.find_node('xray_registration', name)[0]


class NodeCase(unittest.TestCase):
    node = None  # The process.

    def until(self, condition, what):
        end = time.monotonic() + 60.0
        while not condition():
            self.assertIsNone(self.node.poll(), 'the node ended by itself')
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.005)
