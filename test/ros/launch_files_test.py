#!/usr/bin/python3
"""Every launch file resolves: a wrong substitution is otherwise only seen by the user who launches it."""
import os
import sys
import unittest

import roslaunch

SOURCE = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))


def nodes(name, **arguments):
    loader = roslaunch.xmlloader.XmlLoader(resolve_anon=False)
    config = roslaunch.config.ROSLaunchConfig()
    loader.load(os.path.join(SOURCE, "launch", name), config,
                argv=["%s:=%s" % item for item in arguments.items()], verbose=False)
    return {node.name: node for node in config.nodes}, {key: value.value for key, value in config.params.items()}


class LaunchFiles(unittest.TestCase):
    def test_register(self):
        started, parameters = nodes("register.launch", ct="/a/head.nii.gz", views="[ap, oblique]",
                                    initial_pose="{position: [0, 0, 1], orientation: [0, 0, 0, 1]}")
        self.assertEqual(started["xray_registration"].type, "xray_registration_node")
        self.assertEqual(parameters["/xray_registration/ct/path"], "/a/head.nii.gz")
        self.assertEqual(parameters["/xray_registration/views"], ["ap", "oblique"])
        self.assertEqual(parameters["/xray_registration/initial_pose/position"], [0, 0, 1])
        self.assertEqual(parameters["/xray_registration/device"], "auto")

    def test_register_as_nodelet_with_rviz(self):
        started, _ = nodes("register.launch", manager="camera", rviz="true")
        self.assertEqual(started["xray_registration"].package, "nodelet")
        self.assertIn("rviz", started)

    def test_demo(self):
        started, parameters = nodes("demo.launch", ct="/a/head.nii.gz", view="lateral", angle="90")
        self.assertEqual(parameters["/xray_simulator/views"], "lateral:90")
        self.assertIn(("image_raw", "lateral/image_raw"),
                      [tuple(remap) for remap in started["xray_registration"].remap_args])

    def test_replay(self):
        for loop, expected in (("true", True), ("false", False)):
            started, parameters = nodes("replay.launch", bag="/a/b.bag", ct="/a/head.nii.gz", view="lateral", loop=loop)
            self.assertIn("--clock", started["player"].args)
            self.assertEqual("--loop" in started["player"].args, expected)
            self.assertTrue(parameters["/use_sim_time"])
            self.assertIn(("image_raw", "/lateral/image_raw"),
                          [tuple(remap) for remap in started["xray_registration"].remap_args])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
